#include "core/posegraph/solver/robust_minimum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kControlFactor = 1.4;  // the paper's
// Weights that have changed by less leave the minimum where it is, for what is decided next.
constexpr double kSameWeight = 0.3;
// Solved roughly along the way: the next member moves the minimum on.
constexpr ConvergenceOptions kAlongTheWay = {
    .max_iterations = 4, .cost_tolerance = 1e-3, .step_tolerance = 1e-6};

double WorstChi2(const OutlierCandidates& candidates) {
  double worst = 0.0;
  for (std::size_t k = 0; k < candidates.size(); ++k) worst = std::max(worst, candidates.Chi2(k));
  return worst;
}

void SetAll(OutlierCandidates& candidates, double weight) {
  for (std::size_t k = 0; k < candidates.size(); ++k) candidates.Weight(k) = weight;
}

double LargestChange(OutlierCandidates& candidates, const std::vector<double>& weights) {
  double largest = 0.0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const double weight = candidates.Weight(k);
    if (weight == weights[k]) continue;
    largest = std::max(largest, std::abs(weight - weights[k]) / std::max(weight, weights[k]));
  }
  return largest;
}

// True if every weight is 0 or 1.
bool SetWeights(OutlierCandidates& candidates, double max_chi2, double control) {
  bool decided = true;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    double& weight = candidates.Weight(k);
    weight = TruncatedWeight(candidates.Chi2(k), max_chi2, control);
    decided = decided && (weight == 0.0 || weight == 1.0);
  }
  return decided;
}

// The family's members from the convex one on, each from the minimum of the one before.
absl::Status Graduate(OutlierCandidates& candidates,
                      double max_chi2,
                      double control,
                      absl::FunctionRef<absl::Status()> minimise) {
  std::vector<double> solved(candidates.size(), 0.0);
  while (!SetWeights(candidates, max_chi2, control)) {
    if (LargestChange(candidates, solved) > kSameWeight) {
      STRATA_RETURN_IF_ERROR(minimise());
      for (std::size_t k = 0; k < solved.size(); ++k) solved[k] = candidates.Weight(k);
    }
    control *= kControlFactor;
  }
  return absl::OkStatus();
}

// True if a term that counts is above the bound: it counts no longer.
bool RejectMore(OutlierCandidates& candidates, double max_chi2) {
  bool more = false;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (candidates.Weight(k) == 0.0 || candidates.Chi2(k) <= max_chi2) continue;
    candidates.Weight(k) = 0.0;
    more = true;
  }
  return more;
}

// True if any counts.
bool WeighAtFirst(OutlierCandidates& candidates) {
  bool any = false;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    candidates.Weight(k) = candidates.FirstWeight(k);
    any = any || candidates.Weight(k) > 0.0;
  }
  return any;
}

// True if every candidate is known from before, and has its weight.
bool WeighAsBefore(OutlierCandidates& candidates) {
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::optional<bool> believed = candidates.Believed(k);
    if (!believed.has_value()) return false;
    candidates.Weight(k) = *believed ? 1.0 : 0.0;
  }
  return true;
}

// Whether exactly those that count are within the bound.
bool Fits(OutlierCandidates& candidates, double max_chi2) {
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if ((candidates.Weight(k) > 0.0) != (candidates.Chi2(k) <= max_chi2)) return false;
  }
  return true;
}

}  // namespace

double TruncatedWeight(double chi2, double max_chi2, double control) {
  if (chi2 >= (control + 1.0) / control * max_chi2) return 0.0;
  if (chi2 <= control / (control + 1.0) * max_chi2) return 1.0;
  return std::clamp(std::sqrt(max_chi2 / chi2 * control * (control + 1.0)) - control, 0.0, 1.0);
}

absl::StatusOr<Minimum> MinimiseRobustly(
    OutlierCandidates& candidates,
    double max_chi2,
    const ConvergenceOptions& convergence,
    absl::FunctionRef<absl::StatusOr<Minimum>(const ConvergenceOptions&)> minimise) {
  int iterations = 0;
  const auto go_down = [&](const ConvergenceOptions& options) -> absl::StatusOr<Minimum> {
    STRATA_ASSIGN_OR_RETURN(Minimum minimum, minimise(options));
    iterations += minimum.iterations;
    minimum.iterations = iterations;
    return minimum;
  };
  if (candidates.size() == 0 || std::isinf(max_chi2)) return go_down(convergence);

  if (WeighAsBefore(candidates)) {
    STRATA_ASSIGN_OR_RETURN(const Minimum minimum, go_down(convergence));
    if (Fits(candidates, max_chi2)) return minimum;
    candidates.Restart();  // one false closure that was believed folds the graph
  }
  // Not from the minimum of all terms, as in the paper: strong false ones fold the graph.
  const bool any_counts = WeighAtFirst(candidates);
  // What counts from the beginning moves everything: halfway there the wrong ones seem to fit.
  const ConvergenceOptions& along_the_way = any_counts ? convergence : kAlongTheWay;
  STRATA_RETURN_IF_ERROR(go_down(along_the_way).status());
  SetAll(candidates, 1.0);
  const double worst = WorstChi2(candidates);
  if (worst > max_chi2) {
    const double convex = max_chi2 / (2.0 * worst - max_chi2);
    STRATA_RETURN_IF_ERROR(
        Graduate(candidates, max_chi2, convex, [&] { return go_down(along_the_way).status(); }));
  }
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const Minimum minimum, go_down(convergence));
    if (!RejectMore(candidates, max_chi2)) return minimum;
  }
}

}  // namespace strata
