#include "core/posegraph/robust_minimum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kControlFactor = 1.4;  // the paper's
// Solved roughly along the way: the next member moves the minimum on.
constexpr ConvergenceOptions kAlongTheWay = {
    .max_iterations = 4, .cost_tolerance = 1e-3, .step_tolerance = 1e-6};

// The terms that may be false, relative poses first.
class Suspects {
 public:
  Suspects(const PoseGraphProblem& problem, GraphLeastSquares& squares) : squares_(squares) {
    for (std::size_t k = 0; k < problem.relative.size(); ++k) {
      if (problem.relative[k].may_be_false) relative_.push_back(k);
    }
    for (std::size_t k = 0; k < problem.pairs.size(); ++k) {
      if (problem.pairs[k].may_be_false) pairs_.push_back(k);
    }
  }
  std::size_t size() const { return relative_.size() + pairs_.size(); }
  double Chi2(std::size_t k) const {
    return k < relative_.size() ? squares_.RelativeChi2(relative_[k])
                                : squares_.PairsExcess(pairs_[k - relative_.size()]);
  }
  double& Weight(std::size_t k) {
    return k < relative_.size() ? squares_.relative_weights()[relative_[k]]
                                : squares_.pairs_weights()[pairs_[k - relative_.size()]];
  }
  double WorstChi2() const {
    double worst = 0.0;
    for (std::size_t k = 0; k < size(); ++k) worst = std::max(worst, Chi2(k));
    return worst;
  }

 private:
  GraphLeastSquares& squares_;
  std::vector<std::size_t> relative_, pairs_;
};

// True if every weight is 0 or 1.
bool SetWeights(Suspects& suspects, double max_chi2, double control) {
  bool decided = true;
  for (std::size_t k = 0; k < suspects.size(); ++k) {
    double& weight = suspects.Weight(k);
    weight = TruncatedWeight(suspects.Chi2(k), max_chi2, control);
    decided = decided && (weight == 0.0 || weight == 1.0);
  }
  return decided;
}

// True if a term that counts is above the bound: it counts no longer.
bool RejectMore(Suspects& suspects, double max_chi2) {
  bool more = false;
  for (std::size_t k = 0; k < suspects.size(); ++k) {
    if (suspects.Weight(k) == 0.0 || suspects.Chi2(k) <= max_chi2) continue;
    suspects.Weight(k) = 0.0;
    more = true;
  }
  return more;
}

}  // namespace

double TruncatedWeight(double chi2, double max_chi2, double control) {
  if (chi2 >= (control + 1.0) / control * max_chi2) return 0.0;
  if (chi2 <= control / (control + 1.0) * max_chi2) return 1.0;
  return std::clamp(std::sqrt(max_chi2 / chi2 * control * (control + 1.0)) - control, 0.0, 1.0);
}

absl::StatusOr<Minimum> MinimiseRobustly(const PoseGraphProblem& problem,
                                         const PoseGraphOptions& options,
                                         GraphLeastSquares& squares,
                                         BlockCholesky& H,
                                         const Stop& stop) {
  const double bound = options.max_closure_chi2;
  Suspects suspects(problem, squares);
  int iterations = 0;
  const auto go_down = [&](const ConvergenceOptions& convergence) -> absl::StatusOr<Minimum> {
    STRATA_ASSIGN_OR_RETURN(Minimum minimum, Minimise(squares, H, convergence, stop));
    iterations += minimum.iterations;
    minimum.iterations = iterations;
    return minimum;
  };
  if (suspects.size() > 0 && !std::isinf(bound)) {
    // Not from the minimum of all terms, as in the paper: strong false ones fold the graph.
    for (std::size_t k = 0; k < suspects.size(); ++k) suspects.Weight(k) = 0.0;
    STRATA_RETURN_IF_ERROR(go_down(kAlongTheWay).status());
    for (std::size_t k = 0; k < suspects.size(); ++k) suspects.Weight(k) = 1.0;
    const double worst = suspects.WorstChi2();
    if (worst > bound) {
      double control = bound / (2.0 * worst - bound);
      while (!SetWeights(suspects, bound, control)) {
        STRATA_RETURN_IF_ERROR(go_down(kAlongTheWay).status());
        control *= kControlFactor;
      }
    }
  }
  STRATA_ASSIGN_OR_RETURN(Minimum minimum, go_down(options.convergence));
  while (!std::isinf(bound) && RejectMore(suspects, bound)) {
    STRATA_ASSIGN_OR_RETURN(minimum, go_down(options.convergence));
  }
  return minimum;
}

}  // namespace strata
