// The poses that agree best with a pose graph's terms.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_POSE_GRAPH_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_POSE_GRAPH_H_

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Levenberg–Marquardt (Ceres) with analytic derivatives on SE(3) and on planes (3 parameters each),
// sparse Cholesky. A component of the graph in which nothing is fixed and that has no prior is held
// at its first node. What no term determines moves as little as possible. Deterministic, one
// thread.
// INVALID_ARGUMENT naming the term, the field and the bound for indices out of range, i = j,
// numbers that are not finite, matrices that are not symmetric and positive semidefinite (to 1e-9
// of their largest entry), options out of range; CANCELLED or DEADLINE_EXCEEDED by `stop`, asked
// before each iteration.
absl::StatusOr<PoseGraphSolution> OptimizePoseGraph(const PoseGraphProblem& problem,
                                                    const PoseGraphOptions& options = {},
                                                    const Stop& stop = Stop());

// Σ eᵀΩe of the relative poses where they are. REQUIRES: a valid problem.
double Chi2(const PoseGraphProblem& problem);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_POSE_GRAPH_H_
