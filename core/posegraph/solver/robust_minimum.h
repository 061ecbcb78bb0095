// Which terms that may be false are, and the minimum without them.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_ROBUST_MINIMUM_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_ROBUST_MINIMUM_H_

#include <cstddef>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"

#include "core/posegraph/convergence.h"
#include "core/posegraph/solver/minimise.h"

namespace strata {

// The terms that may be false of a sum of squares.
class OutlierCandidates {
 public:
  virtual ~OutlierCandidates() = default;
  virtual std::size_t size() const = 0;
  virtual double Chi2(std::size_t k) const = 0;  // in the current state, without its weight
  virtual double& Weight(std::size_t k) = 0;
  // What it counts at the very beginning, 0 or 1.
  virtual double FirstWeight(std::size_t /*k*/) const { return 0.0; }
  // What is known of it from before: whether it counts.
  virtual std::optional<bool> Believed(std::size_t /*k*/) const { return std::nullopt; }
  // Goes back to the state that minimising began from; of candidates known from before.
  virtual void Restart() {}
};

// Graduated non-convexity (Yang, Antonante, Tzoumas, Carlone 2020) for truncated least squares: a
// candidate counts min(χ², max_chi2), reached through a family of costs that begins convex. Leaves
// the weights at 0 or 1; a candidate whose χ² at the minimum is above the bound has 0. Where all
// candidates are known from before, and exactly those that count are within the bound at their
// minimum, that is it: a minimum of the truncated costs, too.
// `minimise` goes down from the current state with the current weights.
absl::StatusOr<Minimum> MinimiseRobustly(
    OutlierCandidates& candidates,
    double max_chi2,
    const ConvergenceOptions& convergence,
    absl::FunctionRef<absl::StatusOr<Minimum>(const ConvergenceOptions&)> minimise);

// The weight of a term of χ² `chi2` in the family's member `control`: near 0 the convex cost,
// towards infinity the truncated one (eq. 14 there).
double TruncatedWeight(double chi2, double max_chi2, double control);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_ROBUST_MINIMUM_H_
