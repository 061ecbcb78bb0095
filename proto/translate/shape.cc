#include "proto/translate/shape.h"

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/planning.h"

namespace strata::translate {
namespace {

constexpr int kKindOffset = 1;  // the wire's UNSPECIFIED
static_assert(v1::SHAPE_KIND_SPHERE == static_cast<int>(ShapePart::Kind::kSphere) + kKindOffset);

absl::StatusOr<CollisionShape> ShapeFromProto(const v1::CollisionShape& proto) {
  if (proto.xyz_size() % 3 != 0 || proto.triangles_size() % 3 != 0) {
    return absl::InvalidArgumentError(absl::StrCat("shape: ",
                                                   proto.xyz_size(),
                                                   " coordinates and ",
                                                   proto.triangles_size(),
                                                   " corners; both come in threes"));
  }
  CollisionShape shape;
  for (int i = 0; i < proto.xyz_size(); i += 3) {
    shape.vertices.emplace_back(proto.xyz(i), proto.xyz(i + 1), proto.xyz(i + 2));
  }
  for (int i = 0; i < proto.triangles_size(); i += 3) {
    shape.triangles.push_back({proto.triangles(i), proto.triangles(i + 1), proto.triangles(i + 2)});
  }
  for (const v1::ShapePart& in : proto.parts()) {
    if (in.kind() < v1::SHAPE_KIND_BOX || in.kind() > v1::SHAPE_KIND_SPHERE) {
      return absl::InvalidArgumentError(
          absl::StrCat("shape: kind ", static_cast<int>(in.kind()), " of a part is unknown"));
    }
    ShapePart& part = shape.parts.emplace_back();
    part.kind = static_cast<ShapePart::Kind>(in.kind() - kKindOffset);
    STRATA_ASSIGN_OR_RETURN(part.T_shape_part, FromProto("pose", in.pose()));
    STRATA_ASSIGN_OR_RETURN(part.size_m, FromProto("size", in.size()));
  }
  return shape;
}

void ShapeToProto(const CollisionShape& shape, v1::CollisionShape& proto) {
  for (const Eigen::Vector3f& v : shape.vertices) {
    for (const float x : v) proto.add_xyz(x);
  }
  for (const auto& triangle : shape.triangles) {
    for (const std::uint32_t v : triangle) proto.add_triangles(v);
  }
  for (const ShapePart& part : shape.parts) {
    v1::ShapePart& out = *proto.add_parts();
    out.set_kind(static_cast<v1::ShapeKind>(static_cast<int>(part.kind) + kKindOffset));
    *out.mutable_pose() = ToProto(part.T_shape_part);
    *out.mutable_size() = ToProto(part.size_m);
  }
}

}  // namespace

v1::CheckShapeRequest ToProto(absl::string_view map, const ShapeQuery& query) {
  v1::CheckShapeRequest proto;
  proto.set_map(std::string(map));
  ShapeToProto(query.shape, *proto.mutable_shape());
  for (const Pose& pose : query.poses) *proto.add_poses() = ToProto(pose);
  for (const Eigen::Vector3d& p : query.waypoints) *proto.add_waypoints() = ToProto(p);
  proto.set_clearance_m(query.clearance_m);
  proto.set_ground_m(query.ground_m);
  proto.set_unknown_blocks(query.unknown_blocks);
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

absl::StatusOr<ShapeQuery> FromProto(const v1::CheckShapeRequest& proto) {
  ShapeQuery query;
  STRATA_ASSIGN_OR_RETURN(query.shape, ShapeFromProto(proto.shape()));
  for (int i = 0; i < proto.poses_size(); ++i) {
    STRATA_ASSIGN_OR_RETURN(const Pose pose,
                            FromProto(absl::StrCat("poses[", i, "]"), proto.poses(i)));
    query.poses.push_back(pose);
  }
  for (int i = 0; i < proto.waypoints_size(); ++i) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d p,
                            FromProto(absl::StrCat("waypoints[", i, "]"), proto.waypoints(i)));
    query.waypoints.push_back(p);
  }
  query.clearance_m = proto.clearance_m();
  if (proto.has_ground_m()) query.ground_m = proto.ground_m();
  query.unknown_blocks = proto.unknown_blocks();
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  STRATA_RETURN_IF_ERROR(ValidateShapeQuery(query));
  return query;
}

v1::CheckShapeResponse ToProto(const ShapeCheck& check) {
  v1::CheckShapeResponse proto;
  proto.set_free(check.free);
  proto.set_message(check.message);
  proto.set_free_m(check.free_m);
  proto.set_length_m(check.length_m);
  for (const ShapeContact& contact : check.contacts) {
    v1::ShapeContact& out = *proto.add_contacts();
    out.set_from_m(contact.from_m);
    out.set_to_m(contact.to_m);
    *out.mutable_where() = ToProto(contact.where);
    out.set_depth_m(contact.depth_m);
    out.set_class_id(contact.class_id);
    out.set_unknown(contact.unknown);
    out.set_inferred(contact.inferred);
  }
  proto.set_looks(check.looks);
  proto.set_elapsed_ms(check.elapsed_ms);
  proto.set_epoch(check.epoch);
  return proto;
}

absl::StatusOr<ShapeCheck> FromProto(const v1::CheckShapeResponse& proto) {
  ShapeCheck check;
  check.free = proto.free();
  check.message = proto.message();
  check.free_m = proto.free_m();
  check.length_m = proto.length_m();
  for (const v1::ShapeContact& in : proto.contacts()) {
    ShapeContact& contact = check.contacts.emplace_back();
    contact.from_m = in.from_m();
    contact.to_m = in.to_m();
    STRATA_ASSIGN_OR_RETURN(contact.where, FromProto("where", in.where()));
    contact.depth_m = in.depth_m();
    contact.class_id = in.class_id();
    contact.unknown = in.unknown();
    contact.inferred = in.inferred();
  }
  check.looks = proto.looks();
  check.elapsed_ms = proto.elapsed_ms();
  check.epoch = proto.epoch();
  return check;
}

}  // namespace strata::translate
