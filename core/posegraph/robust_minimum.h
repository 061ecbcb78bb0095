// Which terms that may be false are, and the minimum without them.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ROBUST_MINIMUM_H_
#define STRATA_CORE_POSEGRAPH_ROBUST_MINIMUM_H_

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/posegraph/block_cholesky.h"
#include "core/posegraph/graph_least_squares.h"
#include "core/posegraph/levenberg_marquardt.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Graduated non-convexity (Yang, Antonante, Tzoumas, Carlone 2020) for truncated least squares: a
// term counts min(χ², max_closure_chi2), reached through a family of costs that begins convex. Sets
// the weights of `squares` to 0 or 1; a term whose χ² at the minimum is above the bound counts 0.
absl::StatusOr<Minimum> MinimiseRobustly(const PoseGraphProblem& problem,
                                         const PoseGraphOptions& options,
                                         GraphLeastSquares& squares,
                                         BlockCholesky& H,
                                         const Stop& stop);

// The weight of a term of χ² `chi2` in the family's member `control`: near 0 the convex cost,
// towards infinity the truncated one (eq. 14 there).
double TruncatedWeight(double chi2, double max_chi2, double control);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ROBUST_MINIMUM_H_
