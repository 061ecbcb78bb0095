#include "proto/translate/objects.h"

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/world/map_class.h"
#include "proto/translate/geometry.h"
#include "proto/translate/scans.h"

namespace strata::translate {
namespace {

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

}  // namespace

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
  v1::ListEntitiesRequest proto;
  proto.set_map(std::string(map));
  if (query.region.has_value()) *proto.mutable_region() = ToProto(*query.region);
  proto.set_class_id(query.class_id);
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
  EntityQuery query;
  if (proto.has_region()) {
    STRATA_ASSIGN_OR_RETURN(query.region, FromProto("region", proto.region()));
  }
  STRATA_ASSIGN_OR_RETURN(query.class_id, ClassIdFrom(proto.class_id()));
  return query;
}

}  // namespace strata::translate
