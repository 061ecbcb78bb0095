// What the optimisers refuse. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_POSE_GRAPH_CHECKS_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_POSE_GRAPH_CHECKS_H_

#include "absl/status/status.h"

#include "core/posegraph/planar_pose_graph.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

absl::Status ValidateProblem(const PoseGraphProblem& problem);
absl::Status ValidateProblem(const PlanarPoseGraph& graph);
absl::Status ValidateOptions(const PoseGraphOptions& options);
absl::Status ValidateOptions(const PlanarOptions& options);
absl::Status ValidateOptions(const ConvergenceOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_POSE_GRAPH_CHECKS_H_
