// Levenberg–Marquardt over blocks of parameters on manifolds; what 3-D and 2-D pose graphs share.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_LEVENBERG_MARQUARDT_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_LEVENBERG_MARQUARDT_H_

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/posegraph/convergence.h"
#include "core/posegraph/solver/block_cholesky.h"

namespace strata {

// A sum of squares F = Σ rᵀΩr with a current and a trial state.
class LeastSquares {
 public:
  virtual ~LeastSquares() = default;
  // F of the current state.
  virtual double Cost() const = 0;
  // The Gauss–Newton matrix Σ JᵀΩJ into the values of `H` (all zero before) and the vector Σ JᵀΩr
  // of the current state.
  virtual void Linearise(BlockCholesky& H, Eigen::VectorXd& gradient) const = 0;
  // Sets each entry of the diagonal to the mean over the parameters of its kind in its block, so
  // that damping does not depend on the frame's axes.
  virtual void AverageByKind(Eigen::VectorXd& diagonal) const = 0;
  // Sets the trial state to current ⊞ step and answers its F.
  virtual double Try(const Eigen::VectorXd& step) = 0;
  // Makes the trial state the current one.
  virtual void Accept() = 0;
};

struct Minimum {
  double cost = 0.0;
  int iterations = 0;  // linear systems solved
  PoseGraphTermination termination = PoseGraphTermination::kConverged;
};

// Goes down from the current state. Damping is Marquardt's (a multiple of the averaged diagonal),
// raised and lowered as Nielsen (1999) does. `H` has the pattern of `problem`. CANCELLED or
// DEADLINE_EXCEEDED.
absl::StatusOr<Minimum> Minimise(LeastSquares& problem,
                                 BlockCholesky& H,
                                 const ConvergenceOptions& options,
                                 const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_LEVENBERG_MARQUARDT_H_
