// Weights of a network that keep the right labels ahead of all others by a margin (thesis 9.2.1;
// Taskar, Chatalbashev, Koller 2004).
//
// ½ |w|² + c ξ, where ξ is what the best labeling, a wrong point counting one, is ahead of the
// right one: ξ = max_y (N − Σ_i [y_i = ŷ_i] + score(y) − score(ŷ)); w_e ≥ 0.
#ifndef STRATA_CORE_CLASSIFICATION_AMN_AMN_LEARNING_H_
#define STRATA_CORE_CLASSIFICATION_AMN_AMN_LEARNING_H_

#include <cstdint>
#include <numeric>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/classification/amn/amn.h"
#include "core/common/stop.h"

namespace strata {

// A network whose labels are known. Views: what they show must outlive the set.
struct AmnTrainingSet {
  const FeatureMatrix& features;
  std::span<const NetworkEdge> edges;
  std::span<const ClassIndex> labels;  // of every point, < classes
  std::size_t classes = 0;
  // Rows may stand for several points with one label (ReducedPoints): how many each, and how many
  // edges are among them (ContractedNetwork). The objective is then that of all points, over the
  // labelings that give points of one row one label. Both empty: rows are points.
  std::span<const std::uint32_t> counts = {};
  std::span<const std::uint32_t> inner_edges = {};

  double Count(std::size_t row) const { return counts.empty() ? 1.0 : counts[row]; }
  double InnerEdges(std::size_t row) const { return inner_edges.empty() ? 0.0 : inner_edges[row]; }
  double TotalCount() const {
    return counts.empty() ? static_cast<double>(labels.size())
                          : std::accumulate(counts.begin(), counts.end(), 0.0);
  }
};

struct AmnLearningOptions {
  // c · N: what all points wrong would cost; in (0, 1e12].
  double slack_weight = 100.0;
  // Ends once the objective is known to this, relative; in [1e-12, 1].
  double tolerance = 1e-4;
  int max_iterations = 1000;  // cutting planes, in [1, 100000]

  absl::Status Validate() const;
};

struct AmnLearning {
  AmnWeights weights;
  double objective = 0.0;    // ½ |w|² + c ξ, ξ as the planes' oracle sees it
  double lower_bound = 0.0;  // of the least objective; with α-expansion as good as its planes
  int iterations = 0;
  bool converged = false;
};

// By cutting planes with loss-augmented inference (Joachims, Finley, Yu 2009, one slack) instead of
// the quadratic program 9.7, for any size. Exact for two classes; for more α-expansion may overlook
// planes. Errors are those of `stop`.
absl::StatusOr<AmnLearning> LearnByCuttingPlanes(const AmnTrainingSet& set,
                                                 const AmnLearningOptions& options,
                                                 const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_AMN_LEARNING_H_
