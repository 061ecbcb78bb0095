#include "proto/translate/posegraph.h"

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/geometry/primitives.h"
#include "proto/translate/geometry.h"
#include "proto/translate/scans.h"

namespace strata::translate {
namespace {

static_assert(v1::CONSTRAINT_ORIGIN_INGEST == static_cast<int>(ConstraintOrigin::kIngest));
static_assert(v1::CONSTRAINT_ORIGIN_PERSON == static_cast<int>(ConstraintOrigin::kPerson));
static_assert(v1::CONSTRAINT_ORIGIN_OPTIMIZE == static_cast<int>(ConstraintOrigin::kOptimize));
static_assert(v1::PLANE_KIND_WALL == static_cast<int>(PlaneKind::kWall));
static_assert(v1::PLANE_KIND_LEVEL == static_cast<int>(PlaneKind::kLevel));
static_assert(v1::PLANE_KIND_SLOPED == static_cast<int>(PlaneKind::kSloped));

// What both a recorded and a new constraint say.
absl::StatusOr<Constraint> StatementFromProto(const v1::Constraint& proto) {
  Constraint constraint;
  constraint.i = FromProto(proto.i());
  constraint.j = FromProto(proto.j());
  STRATA_ASSIGN_OR_RETURN(constraint.T_i_j, FromProto("pose", proto.pose()));
  STRATA_ASSIGN_OR_RETURN(constraint.information, FromProto("information", proto.information()));
  if (proto.has_enabled()) constraint.enabled = proto.enabled();
  constraint.note = proto.note();
  constraint.may_be_false = proto.may_be_false();
  return constraint;
}

v1::PlaneSupport SupportToProto(const PlaneSupport& support) {
  v1::PlaneSupport proto;
  *proto.mutable_scan() = ToProto(support.scan);
  proto.set_weight(support.weight);
  proto.set_rms_m(support.rms_m);
  return proto;
}

}  // namespace

v1::PoseNode ToProto(const PoseNode& node) {
  v1::PoseNode proto;
  *proto.mutable_id() = ToProto(node.id);
  *proto.mutable_time() = ToProto(node.time);
  proto.set_state(ToProto(node.state));
  *proto.mutable_uploaded() = ToProto(node.T_map_scan_uploaded);
  *proto.mutable_current() = ToProto(node.T_map_scan);
  return proto;
}

absl::StatusOr<PoseNode> FromProto(const v1::PoseNode& proto) {
  PoseNode node;
  node.id = FromProto(proto.id());
  STRATA_ASSIGN_OR_RETURN(node.time, FromProto("time", proto.time()));
  STRATA_ASSIGN_OR_RETURN(node.state, FromProto(proto.state()));
  STRATA_ASSIGN_OR_RETURN(node.T_map_scan_uploaded, FromProto("uploaded", proto.uploaded()));
  STRATA_ASSIGN_OR_RETURN(node.T_map_scan, FromProto("current", proto.current()));
  return node;
}

v1::Constraint ToProto(const Constraint& constraint) {
  v1::Constraint proto;
  proto.set_id(constraint.id);
  if (!constraint.is_prior()) *proto.mutable_i() = ToProto(constraint.i);
  *proto.mutable_j() = ToProto(constraint.j);
  *proto.mutable_pose() = ToProto(constraint.T_i_j);
  *proto.mutable_information() = ToProto(constraint.information);
  proto.set_origin(static_cast<v1::ConstraintOrigin>(constraint.origin));
  proto.set_enabled(constraint.enabled);
  proto.set_note(constraint.note);
  proto.set_may_be_false(constraint.may_be_false);
  return proto;
}

absl::StatusOr<Constraint> FromProto(const v1::Constraint& proto) {
  const std::string what = absl::StrCat("constraint ", proto.id());
  if (!v1::ConstraintOrigin_IsValid(proto.origin()) ||
      proto.origin() == v1::CONSTRAINT_ORIGIN_UNSPECIFIED) {
    return absl::InvalidArgumentError(
        absl::StrCat(what, ": origin ", static_cast<int>(proto.origin()), " is not known"));
  }
  absl::StatusOr<Constraint> constraint = StatementFromProto(proto);
  if (!constraint.ok()) return Annotate(constraint.status(), what);
  constraint->id = proto.id();
  constraint->origin = static_cast<ConstraintOrigin>(proto.origin());
  return constraint;
}

absl::StatusOr<Constraint> NewConstraintFromProto(const v1::Constraint& proto) {
  STRATA_ASSIGN_OR_RETURN(Constraint constraint, StatementFromProto(proto));
  constraint.origin = ConstraintOrigin::kPerson;
  STRATA_RETURN_IF_ERROR(ValidateConstraint(constraint));
  return constraint;
}

v1::Plane ToProto(const Plane& plane) {
  v1::Plane proto;
  *proto.mutable_normal() = ToProto(plane.normal);
  proto.set_distance(plane.distance);
  return proto;
}

absl::StatusOr<Plane> FromProto(absl::string_view what, const v1::Plane& proto) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d normal, FromProto(what, proto.normal()));
  return MakePlane(normal, proto.distance());
}

absl::StatusOr<PlaneKind> FromProto(absl::string_view what, v1::PlaneKind kind) {
  if (v1::PlaneKind_IsValid(kind) && kind != v1::PLANE_KIND_UNSPECIFIED) {
    return static_cast<PlaneKind>(kind);
  }
  return absl::InvalidArgumentError(
      absl::StrCat(what, ": kind ", static_cast<int>(kind), " is not known"));
}

v1::GlobalPlane ToProto(const GlobalPlane& plane) {
  v1::GlobalPlane proto;
  proto.set_id(plane.id);
  *proto.mutable_plane() = ToProto(plane.plane);
  proto.set_kind(static_cast<v1::PlaneKind>(plane.kind));
  proto.set_from_edges(plane.from_edges);
  proto.set_enabled(plane.enabled);
  for (const PlaneSupport& support : plane.supports) {
    *proto.add_supports() = SupportToProto(support);
  }
  proto.set_note(plane.note);
  return proto;
}

absl::StatusOr<GlobalPlane> FromProto(const v1::GlobalPlane& proto) {
  const std::string what = absl::StrCat("plane ", proto.id());
  GlobalPlane plane;
  plane.id = proto.id();
  STRATA_ASSIGN_OR_RETURN(plane.plane, FromProto(what, proto.plane()));
  STRATA_ASSIGN_OR_RETURN(plane.kind, FromProto(what, proto.kind()));
  plane.from_edges = proto.from_edges();
  plane.enabled = proto.enabled();
  for (const v1::PlaneSupport& support : proto.supports()) {
    plane.supports.push_back({FromProto(support.scan()), support.weight(), support.rms_m()});
  }
  plane.note = proto.note();
  return plane;
}

v1::LookupPoseResponse ToProto(const api::PoseLookup& lookup) {
  v1::LookupPoseResponse proto;
  proto.set_known(lookup.known);
  proto.set_message(lookup.message);
  *proto.mutable_pose() = ToProto(lookup.T_map_scan);
  proto.set_epoch(lookup.epoch);
  return proto;
}

absl::StatusOr<api::PoseLookup> FromProto(const v1::LookupPoseResponse& proto) {
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_scan, FromProto("pose", proto.pose()));
  return api::PoseLookup{proto.known(), proto.message(), T_map_scan, proto.epoch()};
}

}  // namespace strata::translate
