#include "proto/translate/models.h"

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/common/status.h"
#include "core/geometry/primitives.h"
#include "proto/translate/geometry.h"
#include "proto/translate/posegraph.h"

namespace strata::translate {
namespace {

void Put(const PlaneRing& ring, v1::PlaneRing& proto) {
  for (const Eigen::Vector3d& p : ring) {
    for (const double x : p) proto.add_xyz(x);
  }
}

absl::StatusOr<PlaneRing> RingOf(const v1::PlaneRing& proto) {
  if (proto.xyz_size() % 3 != 0 || proto.xyz_size() < 9) {
    return absl::InvalidArgumentError(absl::StrCat(
        "ring of ", proto.xyz_size(), " numbers: three a point, three points or more"));
  }
  PlaneRing ring;
  for (int i = 0; i < proto.xyz_size(); i += 3) {
    ring.emplace_back(proto.xyz(i), proto.xyz(i + 1), proto.xyz(i + 2));
    if (!ring.back().allFinite()) return absl::InvalidArgumentError("ring: a point is not finite");
  }
  return ring;
}

absl::StatusOr<PlanePolygon> PolygonOf(const v1::PlanePolygon& proto) {
  PlanePolygon polygon;
  STRATA_ASSIGN_OR_RETURN(polygon.outer, RingOf(proto.outer()));
  for (const v1::PlaneHole& hole : proto.holes()) {
    STRATA_ASSIGN_OR_RETURN(PlaneRing ring, RingOf(hole.ring()));
    polygon.holes.push_back({std::move(ring), hole.seen_open()});
  }
  polygon.area_m2 = proto.area_m2();
  return polygon;
}

}  // namespace

v1::ModelPlane ToProto(const ModelPlane& plane) {
  v1::ModelPlane proto;
  proto.set_id(plane.id);
  *proto.mutable_plane() = ToProto(plane.plane);
  proto.set_kind(static_cast<v1::PlaneKind>(plane.kind));
  if (plane.direction != kNoDirection) proto.set_direction(plane.direction);
  proto.set_area_m2(plane.area_m2);
  proto.set_points(plane.point_count);
  proto.set_rms_m(plane.rms_m);
  proto.set_sigma_m(plane.sigma_m);
  proto.set_sigma_rad(plane.sigma_rad);
  if (plane.colour.has_value()) proto.set_colour(PackedRgb(*plane.colour));
  for (const PlanePolygon& polygon : plane.polygons) {
    v1::PlanePolygon& added = *proto.add_polygons();
    Put(polygon.outer, *added.mutable_outer());
    for (const PlaneHole& hole : polygon.holes) {
      v1::PlaneHole& out = *added.add_holes();
      Put(hole.ring, *out.mutable_ring());
      out.set_seen_open(hole.seen_open);
    }
    added.set_area_m2(polygon.area_m2);
  }
  return proto;
}

absl::StatusOr<ModelPlane> FromProto(const v1::ModelPlane& proto) {
  ModelPlane plane;
  plane.id = proto.id();
  STRATA_ASSIGN_OR_RETURN(plane.plane, FromProto("plane", proto.plane()));
  STRATA_ASSIGN_OR_RETURN(plane.kind, FromProto("kind", proto.kind()));
  plane.direction = proto.has_direction() ? proto.direction() : kNoDirection;
  plane.area_m2 = proto.area_m2();
  plane.point_count = proto.points();
  plane.rms_m = proto.rms_m();
  plane.sigma_m = proto.sigma_m();
  plane.sigma_rad = proto.sigma_rad();
  if (proto.colour() > 0xFFFFFF) {
    return absl::InvalidArgumentError(
        absl::StrCat("colour = ", proto.colour(), " is not 0xRRGGBB"));
  }
  if (proto.has_colour()) plane.colour = ColourOfRgb(proto.colour());
  for (const v1::PlanePolygon& polygon : proto.polygons()) {
    STRATA_ASSIGN_OR_RETURN(PlanePolygon added, PolygonOf(polygon));
    plane.polygons.push_back(std::move(added));
  }
  return plane;
}

v1::PlaneModel ToProto(const PlaneModelInfo& info) {
  v1::PlaneModel proto;
  proto.set_job(info.job);
  proto.set_epoch(info.epoch);
  *proto.mutable_made() = ToProto(info.made);
  proto.set_scans(info.scans);
  proto.set_points(info.points);
  proto.set_planes(info.planes);
  for (const MainDirection& direction : info.directions) {
    v1::MainDirection& added = *proto.add_directions();
    *added.mutable_direction() = ToProto(direction.direction);
    added.set_planes(direction.planes);
    added.set_sigma_rad(direction.sigma_rad);
  }
  return proto;
}

absl::StatusOr<PlaneModelInfo> FromProto(const v1::PlaneModel& proto) {
  PlaneModelInfo info;
  info.job = proto.job();
  info.epoch = proto.epoch();
  STRATA_ASSIGN_OR_RETURN(info.made, FromProto("made", proto.made()));
  info.scans = proto.scans();
  info.points = proto.points();
  info.planes = proto.planes();
  for (const v1::MainDirection& direction : proto.directions()) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d along,
                            FromProto("direction", direction.direction()));
    info.directions.push_back({along, direction.planes(), direction.sigma_rad()});
  }
  return info;
}

}  // namespace strata::translate
