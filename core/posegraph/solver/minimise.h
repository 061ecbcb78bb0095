// A minimum by Ceres. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_MINIMISE_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_MINIMISE_H_

#include "absl/status/statusor.h"
#include <ceres/problem.h>

#include "core/common/stop.h"
#include "core/posegraph/convergence.h"

namespace strata {

struct Minimum {
  int iterations = 0;  // linear systems solved
  PoseGraphTermination termination = PoseGraphTermination::kConverged;
};

// Goes down from where the problem's blocks are and leaves them there: Levenberg–Marquardt, sparse
// Cholesky, one thread; the same problem gives the same bytes. CANCELLED or DEADLINE_EXCEEDED.
absl::StatusOr<Minimum> Minimise(ceres::Problem& problem,
                                 const ConvergenceOptions& convergence,
                                 const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_MINIMISE_H_
