// The pose graph between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_POSEGRAPH_H_
#define STRATA_PROTO_TRANSLATE_POSEGRAPH_H_

#include "absl/status/statusor.h"

#include "core/api/posegraph.h"
#include "core/world/constraint.h"
#include "strata/v1/posegraph.pb.h"

namespace strata::translate {

v1::PoseNode ToProto(const PoseNode& node);
v1::Constraint ToProto(const Constraint& constraint);
v1::Plane ToProto(const Plane& plane);
v1::GlobalPlane ToProto(const GlobalPlane& plane);
v1::LookupPoseResponse ToProto(const api::PoseLookup& lookup);

absl::StatusOr<PoseNode> FromProto(const v1::PoseNode& node);
// INVALID_ARGUMENT also when the information matrix has not 36 finite numbers.
absl::StatusOr<Constraint> FromProto(const v1::Constraint& constraint);
// A constraint to be added: without id and origin, whatever they are, and valid
// (ValidateConstraint).
absl::StatusOr<Constraint> NewConstraintFromProto(const v1::Constraint& constraint);
absl::StatusOr<Plane> FromProto(absl::string_view what, const v1::Plane& plane);
absl::StatusOr<PlaneKind> FromProto(absl::string_view what, v1::PlaneKind kind);
absl::StatusOr<GlobalPlane> FromProto(const v1::GlobalPlane& plane);
absl::StatusOr<api::PoseLookup> FromProto(const v1::LookupPoseResponse& lookup);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_POSEGRAPH_H_
