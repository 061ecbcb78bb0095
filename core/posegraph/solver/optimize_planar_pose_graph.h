// The planar poses that agree best with a planar pose graph's terms.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_PLANAR_POSE_GRAPH_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_PLANAR_POSE_GRAPH_H_

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/posegraph/planar_pose_graph.h"

namespace strata {

// As OptimizePoseGraph().
absl::StatusOr<PlanarSolution> OptimizePlanarPoseGraph(const PlanarPoseGraph& graph,
                                                       const PlanarOptions& options = {},
                                                       const Stop& stop = Stop());

// Σ eᵀΩe. REQUIRES: a valid graph.
double Chi2(const PlanarPoseGraph& graph);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_OPTIMIZE_PLANAR_POSE_GRAPH_H_
