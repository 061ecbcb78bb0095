#include "proto/translate/objects.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <google/protobuf/repeated_field.h>

#include "core/common/status.h"
#include "core/world/map_class.h"
#include "proto/translate/geometry.h"
#include "proto/translate/scans.h"

namespace strata::translate {
namespace {

constexpr double kMostInferredM = 1e8;  // as far as poses

absl::StatusOr<std::uint16_t> ClassIdFrom(std::uint32_t class_id) {
  if (class_id <= kMaxClassId) return static_cast<std::uint16_t>(class_id);
  return absl::InvalidArgumentError(
      absl::StrCat("class_id = ", class_id, " is above ", kMaxClassId));
}

v1::UprightBox BoxToProto(const UprightBox& box) {
  v1::UprightBox proto;
  *proto.mutable_centre() = ToProto(box.centre);
  *proto.mutable_size() = ToProto(box.size);
  proto.set_yaw_rad(box.yaw_rad);
  return proto;
}

absl::StatusOr<UprightBox> BoxFromProto(const v1::UprightBox& proto) {
  UprightBox box;
  STRATA_ASSIGN_OR_RETURN(box.centre, FromProto("box.centre", proto.centre()));
  STRATA_ASSIGN_OR_RETURN(box.size, FromProto("box.size", proto.size()));
  box.yaw_rad = proto.yaw_rad();
  return box;
}

v1::EntityKind KindToProto(const EntityKind& kind) {
  v1::EntityKind proto;
  proto.set_id(kind.id);
  proto.set_name(kind.name);
  *proto.mutable_t_map_kind() = ToProto(kind.T_map_kind);
  proto.set_residual_m(kind.residual_m);
  proto.set_overlap(kind.overlap);
  return proto;
}

absl::StatusOr<EntityKind> KindFromProto(const v1::EntityKind& proto) {
  EntityKind kind;
  kind.id = proto.id();
  kind.name = proto.name();
  STRATA_ASSIGN_OR_RETURN(kind.T_map_kind, FromProto("kind.t_map_kind", proto.t_map_kind()));
  kind.residual_m = proto.residual_m();
  kind.overlap = proto.overlap();
  return kind;
}

void PlacesToProto(const std::vector<Eigen::Vector3f>& places,
                   google::protobuf::RepeatedField<float>& proto) {
  proto.Reserve(static_cast<int>(3 * places.size()));
  for (const Eigen::Vector3f& p : places) {
    for (const float x : p) proto.Add(x);
  }
}

absl::Status CheckTriples(absl::string_view what, int numbers, std::size_t most) {
  if (numbers % 3 == 0 && static_cast<std::size_t>(numbers) <= 3 * most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "shape.", what, " has ", numbers, " numbers, must be three each of at most ", most));
}

std::vector<Eigen::Vector3f> PlacesFrom(const google::protobuf::RepeatedField<float>& proto) {
  std::vector<Eigen::Vector3f> places;
  for (int i = 0; i < proto.size(); i += 3)
    places.emplace_back(proto[i], proto[i + 1], proto[i + 2]);
  return places;
}

template <typename Request>
Request QueryToProto(absl::string_view map, const EntityQuery& query) {
  Request proto;
  proto.set_map(std::string(map));
  if (query.region.has_value()) *proto.mutable_region() = ToProto(*query.region);
  proto.set_class_id(query.class_id);
  proto.set_kind(query.kind);
  return proto;
}

template <typename Request>
absl::StatusOr<EntityQuery> QueryFromProto(const Request& proto) {
  EntityQuery query;
  if (proto.has_region()) {
    STRATA_ASSIGN_OR_RETURN(query.region, FromProto("region", proto.region()));
  }
  STRATA_ASSIGN_OR_RETURN(query.class_id, ClassIdFrom(proto.class_id()));
  query.kind = proto.kind();
  return query;
}

}  // namespace

static_assert(v1::KIND_ORIGIN_FOUND == static_cast<int>(KindOrigin::kFound));
static_assert(v1::KIND_ORIGIN_NAMED == static_cast<int>(KindOrigin::kNamed));
static_assert(v1::KIND_ORIGIN_IMPORTED == static_cast<int>(KindOrigin::kImported));

v1::Entity ToProto(const Entity& entity) {
  v1::Entity proto;
  proto.set_id(entity.id);
  proto.set_class_id(entity.class_id);
  *proto.mutable_box() = BoxToProto(entity.box);
  proto.set_radius_m(entity.radius_m);
  proto.set_points(entity.points);
  for (const EntityScan& seen : entity.scans) {
    v1::EntityScan& added = *proto.add_scans();
    *added.mutable_scan() = ToProto(seen.scan);
    added.set_points(seen.points);
  }
  if (entity.kind.has_value()) *proto.mutable_kind() = KindToProto(*entity.kind);
  return proto;
}

v1::EntitySearch ToProto(const EntitiesInfo& info) {
  v1::EntitySearch proto;
  proto.set_job(info.job);
  proto.set_epoch(info.epoch);
  *proto.mutable_made() = ToProto(info.made);
  proto.set_scans(info.scans);
  proto.set_points(info.points);
  proto.set_entities(info.entities);
  for (const ClassReach& reach : info.reaches) {
    v1::ClassReach& added = *proto.add_reaches();
    added.set_class_id(reach.class_id);
    added.set_distance_m(reach.distance_m);
  }
  return proto;
}

v1::ListEntitiesRequest ToProto(absl::string_view map, const EntityQuery& query) {
  return QueryToProto<v1::ListEntitiesRequest>(map, query);
}

v1::ListInferredRequest ToInferredRequest(absl::string_view map, const EntityQuery& query) {
  return QueryToProto<v1::ListInferredRequest>(map, query);
}

v1::InferredPart ToProto(const InferredPart& part) {
  v1::InferredPart proto;
  proto.set_entity(part.entity);
  proto.set_kind(part.kind);
  proto.set_agreeing(part.agreeing);
  proto.set_contradicting(part.contradicting);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : part.points)
    middle += p / static_cast<double>(part.points.size());
  *proto.mutable_middle() = ToProto(middle);
  std::vector<Eigen::Vector3f> offsets;
  for (const Eigen::Vector3d& p : part.points) offsets.emplace_back((p - middle).cast<float>());
  PlacesToProto(offsets, *proto.mutable_points());
  return proto;
}

v1::InferredSearch ToProto(const InferredInfo& info) {
  v1::InferredSearch proto;
  proto.set_job(info.job);
  proto.set_epoch(info.epoch);
  *proto.mutable_made() = ToProto(info.made);
  proto.set_kinds(info.kinds);
  proto.set_entities(info.entities);
  proto.set_points(info.points);
  return proto;
}

v1::KindInfo ToProto(const KindInfo& info) {
  v1::KindInfo proto;
  proto.set_id(info.id);
  proto.set_name(info.name);
  proto.set_class_id(info.class_id);
  proto.set_origin(static_cast<v1::KindOrigin>(info.origin));
  *proto.mutable_made() = ToProto(info.made);
  *proto.mutable_size() = ToProto(info.size);
  proto.set_points(info.points);
  proto.set_triangles(info.triangles);
  proto.set_entities(info.entities);
  return proto;
}

v1::KindShape ToProto(const KindShape& shape) {
  v1::KindShape proto;
  PlacesToProto(shape.points, *proto.mutable_points());
  PlacesToProto(shape.vertices, *proto.mutable_vertices());
  proto.mutable_triangles()->Reserve(static_cast<int>(3 * shape.triangles.size()));
  for (const auto& triangle : shape.triangles) {
    for (const std::uint32_t vertex : triangle) proto.add_triangles(vertex);
  }
  return proto;
}

v1::ImportKindRequest ToProto(absl::string_view map, const NewKind& kind) {
  v1::ImportKindRequest proto;
  proto.set_map(std::string(map));
  proto.set_name(kind.name);
  proto.set_class_name(kind.class_name);
  *proto.mutable_shape() = ToProto(kind.shape);
  return proto;
}

absl::StatusOr<Entity> FromProto(const v1::Entity& proto) {
  Entity entity;
  entity.id = proto.id();
  STRATA_ASSIGN_OR_RETURN(entity.class_id, ClassIdFrom(proto.class_id()));
  STRATA_ASSIGN_OR_RETURN(entity.box, BoxFromProto(proto.box()));
  entity.radius_m = proto.radius_m();
  entity.points = proto.points();
  for (const v1::EntityScan& seen : proto.scans()) {
    entity.scans.push_back({FromProto(seen.scan()), seen.points()});
  }
  if (proto.has_kind()) {
    STRATA_ASSIGN_OR_RETURN(entity.kind, KindFromProto(proto.kind()));
  }
  return entity;
}

absl::StatusOr<EntitiesInfo> FromProto(const v1::EntitySearch& proto) {
  EntitiesInfo info;
  info.job = proto.job();
  info.epoch = proto.epoch();
  STRATA_ASSIGN_OR_RETURN(info.made, FromProto("made", proto.made()));
  info.scans = proto.scans();
  info.points = proto.points();
  info.entities = proto.entities();
  for (const v1::ClassReach& reach : proto.reaches()) {
    STRATA_ASSIGN_OR_RETURN(const std::uint16_t class_id, ClassIdFrom(reach.class_id()));
    info.reaches.push_back({class_id, reach.distance_m()});
  }
  return info;
}

absl::StatusOr<EntityQuery> FromProto(const v1::ListEntitiesRequest& proto) {
  return QueryFromProto(proto);
}

absl::StatusOr<EntityQuery> FromProto(const v1::ListInferredRequest& proto) {
  return QueryFromProto(proto);
}

absl::StatusOr<InferredPart> FromProto(const v1::InferredPart& proto) {
  STRATA_RETURN_IF_ERROR(CheckTriples("points", proto.points_size(), kMostInferredPoints));
  InferredPart part;
  part.entity = proto.entity();
  part.kind = proto.kind();
  part.agreeing = proto.agreeing();
  part.contradicting = proto.contradicting();
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d middle, FromProto("middle", proto.middle()));
  for (const Eigen::Vector3f& offset : PlacesFrom(proto.points())) {
    const Eigen::Vector3d p = middle + offset.cast<double>();
    if (!(p.array().abs() <= kMostInferredM).all()) {
      return absl::InvalidArgumentError(absl::StrCat("points[",
                                                     part.points.size(),
                                                     "] of what is inferred of entity ",
                                                     part.entity,
                                                     " is not within ",
                                                     kMostInferredM,
                                                     " m of the map's origin"));
    }
    part.points.push_back(p);
  }
  return part;
}

absl::StatusOr<InferredInfo> FromProto(const v1::InferredSearch& proto) {
  InferredInfo info;
  info.job = proto.job();
  info.epoch = proto.epoch();
  STRATA_ASSIGN_OR_RETURN(info.made, FromProto("made", proto.made()));
  info.kinds = proto.kinds();
  info.entities = proto.entities();
  info.points = proto.points();
  return info;
}

absl::StatusOr<KindInfo> FromProto(const v1::KindInfo& proto) {
  KindInfo info;
  info.id = proto.id();
  info.name = proto.name();
  STRATA_ASSIGN_OR_RETURN(info.class_id, ClassIdFrom(proto.class_id()));
  if (!v1::KindOrigin_IsValid(proto.origin()) || proto.origin() == v1::KIND_ORIGIN_UNSPECIFIED) {
    return absl::InvalidArgumentError(absl::StrCat("kind.origin = ", proto.origin()));
  }
  info.origin = static_cast<KindOrigin>(proto.origin());
  STRATA_ASSIGN_OR_RETURN(info.made, FromProto("kind.made", proto.made()));
  STRATA_ASSIGN_OR_RETURN(info.size, FromProto("kind.size", proto.size()));
  info.points = proto.points();
  info.triangles = proto.triangles();
  info.entities = proto.entities();
  return info;
}

absl::StatusOr<KindShape> FromProto(const v1::KindShape& proto) {
  STRATA_RETURN_IF_ERROR(CheckTriples("points", proto.points_size(), kMaxKindPoints));
  STRATA_RETURN_IF_ERROR(CheckTriples("vertices", proto.vertices_size(), kMaxKindVertices));
  STRATA_RETURN_IF_ERROR(CheckTriples("triangles", proto.triangles_size(), kMaxKindTriangles));
  KindShape shape;
  shape.points = PlacesFrom(proto.points());
  shape.vertices = PlacesFrom(proto.vertices());
  for (int i = 0; i < proto.triangles_size(); i += 3) {
    shape.triangles.push_back({proto.triangles(i), proto.triangles(i + 1), proto.triangles(i + 2)});
  }
  STRATA_RETURN_IF_ERROR(ValidateKindShape(shape));
  return shape;
}

absl::StatusOr<NewKind> FromProto(const v1::ImportKindRequest& proto) {
  NewKind kind;
  kind.name = proto.name();
  kind.class_name = proto.class_name();
  STRATA_ASSIGN_OR_RETURN(kind.shape, FromProto(proto.shape()));
  return kind;
}

}  // namespace strata::translate
