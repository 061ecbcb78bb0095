// The pose graph between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_POSEGRAPH_H_
#define STRATA_PROTO_TRANSLATE_POSEGRAPH_H_

#include "absl/status/statusor.h"

#include "core/world/constraint.h"
#include "strata/v1/posegraph.pb.h"

namespace strata::translate {

v1::PoseNode ToProto(const PoseNode& node);
v1::Constraint ToProto(const Constraint& constraint);

absl::StatusOr<PoseNode> FromProto(const v1::PoseNode& node);
// INVALID_ARGUMENT also when the information matrix has not 36 finite numbers.
absl::StatusOr<Constraint> FromProto(const v1::Constraint& constraint);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_POSEGRAPH_H_
