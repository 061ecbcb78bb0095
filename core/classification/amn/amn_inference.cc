#include "core/classification/amn/amn_inference.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include "core/classification/amn/min_cut.h"
#include "core/common/status.h"

namespace strata {
namespace {

// A move is taken only if it gains more than rounding can.
constexpr double kLeastGain = 1e-9;

// Lets points change to one class, all at once (an expansion move).
class Expander {
 public:
  explicit Expander(const AmnProblem& problem)
      : problem_(problem), cut_(problem.points(), problem.edges), gain_(problem.points()) {}

  // The best of all labelings in which points keep their label or take `alpha`.
  std::vector<ClassIndex> Expand(ClassIndex alpha, const std::vector<ClassIndex>& labels) {
    // gain_: of changing, as far as it does not depend on what others do.
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      gain_[i] = problem_.node_scores(row, alpha) - problem_.node_scores(row, labels[i]);
    }
    for (std::size_t e = 0; e < problem_.edges.size(); ++e) SetEdge(e, alpha, labels);
    // The source's side keeps its label: there the cut costs what is lost by not changing.
    for (std::size_t i = 0; i < labels.size(); ++i) cut_.SetTerminal(i, -gain_[i]);
    cut_.Solve();
    std::vector<ClassIndex> moved = labels;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      if (cut_.OnSinkSide(i)) moved[i] = alpha;
    }
    return moved;
  }

 private:
  double Reward(ClassIndex a, ClassIndex b) const { return a == b ? problem_.edge_scores[a] : 0.0; }

  // Rewards of an edge as a function of who changes, taken apart (Kolmogorov, Zabih 2004).
  void SetEdge(std::size_t e, ClassIndex alpha, const std::vector<ClassIndex>& labels) {
    const NetworkEdge& edge = problem_.edges[e];
    const ClassIndex a = labels[edge.i];
    const ClassIndex b = labels[edge.j];
    const double neither = Reward(a, b);
    const double j_changes = Reward(a, alpha);
    const double i_changes = Reward(alpha, b);
    const double both = Reward(alpha, alpha);
    gain_[edge.i] += i_changes - neither;
    gain_[edge.j] += both - i_changes;
    // Never negative: rewards are not, and only equal labels are rewarded.
    cut_.SetEdge(e, neither + both - i_changes - j_changes, 0.0);
  }

  const AmnProblem& problem_;
  MinCut cut_;
  std::vector<double> gain_;
};

}  // namespace

absl::StatusOr<AmnLabels> MaximizeScore(const AmnProblem& problem, const Stop& stop) {
  AmnLabels best;
  best.labels = LargestScores(problem.node_scores);
  best.score = Score(problem, best.labels);
  if (problem.classes() < 2 || problem.points() == 0) return best;
  Expander expander(problem);
  if (problem.classes() == 2) {
    STRATA_RETURN_IF_ERROR(stop.status());
    // From all points in one class, an expansion of the other one reaches every labeling.
    best.labels = expander.Expand(1, std::vector<ClassIndex>(problem.points(), 0));
    best.score = Score(problem, best.labels);
    return best;
  }
  for (std::size_t failed = 0; failed < problem.classes(); ++best.sweeps) {
    for (std::size_t k = 0; k < problem.classes() && failed < problem.classes(); ++k) {
      STRATA_RETURN_IF_ERROR(stop.status());
      std::vector<ClassIndex> moved = expander.Expand(static_cast<ClassIndex>(k), best.labels);
      const double score = Score(problem, moved);
      if (score > best.score + kLeastGain * (1.0 + std::abs(best.score))) {
        best.labels = std::move(moved);
        best.score = score;
        failed = 0;
      } else {
        ++failed;
      }
    }
  }
  return best;
}

}  // namespace strata
