// How sure a pose graph is of its poses.
#ifndef STRATA_CORE_POSEGRAPH_COVARIANCE_H_
#define STRATA_CORE_POSEGRAPH_COVARIANCE_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// The marginal covariance [rotation, translation] of a right-hand step on the pose of each of
// `nodes`, at the poses of `problem` (its optimum, if they are to mean something), all terms
// counted in full: leave out what was rejected. Nodes that are fixed or held (as in
// OptimizePoseGraph) have zero. With one node fixed and no priors, these are the covariances of the
// other poses relative to it, which is what a loop closure is to be compared with.
//
// Costs about two factorisations of the graph, however many nodes are asked for; along a chain that
// is linear in its length. INVALID_ARGUMENT as OptimizePoseGraph, and for a node out of range;
// FAILED_PRECONDITION if the terms leave a pose undetermined; CANCELLED or DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<Matrix6d>> MarginalCovariances(const PoseGraphProblem& problem,
                                                          const std::vector<std::size_t>& nodes,
                                                          const Stop& stop = Stop());

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COVARIANCE_H_
