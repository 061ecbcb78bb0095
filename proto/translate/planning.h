// Questions of planners and their answers between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_PLANNING_H_
#define STRATA_PROTO_TRANSLATE_PLANNING_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/exploration.h"
#include "core/world/floor.h"
#include "core/world/plan.h"
#include "strata/v1/planning.pb.h"

namespace strata::translate {

v1::PlanEndpoint EndpointToProto(const PlanEndpoint& endpoint);
// INVALID_ARGUMENT, named `what`, for coordinates that are not finite and a negative level.
absl::StatusOr<PlanEndpoint> EndpointFromProto(const char* what, const v1::PlanEndpoint& endpoint);

v1::InferredAs ToProto(InferredAs as);
// INVALID_ARGUMENT for a value that is not known.
absl::StatusOr<InferredAs> FromProto(v1::InferredAs as);

v1::PlanPathRequest ToProto(absl::string_view map, const PlanQuery& query);
v1::PlanPathResponse ToProto(const PlanResult& result);
v1::SurfaceColumn ToProto(const SurfaceColumn& column);
v1::PathCheck ToProto(const PathCheck& check);
v1::ListFloorsRequest ToProto(absl::string_view map, const FloorQuery& query);
v1::ListFloorsResponse ToProto(const FloorPlan& plan);
v1::ExploreRequest ToProto(absl::string_view map, const ExploreQuery& query);
v1::ExploreResponse ToProto(const ExploreResult& result);
v1::CheckPathRequest CheckToProto(absl::string_view map, const PathQuery& query);
// Without what is known.
v1::WatchPathRequest WatchToProto(absl::string_view map, const PathQuery& query);

// INVALID_ARGUMENT for coordinates that are not finite, a negative level, or a profile out of
// range.
absl::StatusOr<PlanQuery> FromProto(const v1::PlanPathRequest& request);
absl::StatusOr<PlanResult> FromProto(const v1::PlanPathResponse& result);
absl::StatusOr<SurfaceColumn> FromProto(const v1::SurfaceColumn& column);
absl::StatusOr<PathCheck> FromProto(const v1::PathCheck& check);
absl::StatusOr<FloorQuery> FromProto(const v1::ListFloorsRequest& request);
absl::StatusOr<FloorPlan> FromProto(const v1::ListFloorsResponse& plan);
absl::StatusOr<ExploreQuery> FromProto(const v1::ExploreRequest& request);
absl::StatusOr<ExploreResult> FromProto(const v1::ExploreResponse& result);
absl::StatusOr<PathQuery> FromProto(const v1::CheckPathRequest& request);
absl::StatusOr<PathQuery> FromProto(const v1::WatchPathRequest& request);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_PLANNING_H_
