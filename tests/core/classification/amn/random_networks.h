// Networks drawn at random, for tests against enumeration.
#ifndef STRATA_TESTS_CORE_CLASSIFICATION_AMN_RANDOM_NETWORKS_H_
#define STRATA_TESTS_CORE_CLASSIFICATION_AMN_RANDOM_NETWORKS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/classification/amn/amn.h"
#include "core/common/random.h"

namespace strata::testing {

inline std::vector<NetworkEdge> RandomEdges(std::uint32_t points, int count, SplitMix64& random) {
  std::vector<NetworkEdge> edges;
  for (int tries = 0; tries < 20 * count && static_cast<int>(edges.size()) < count; ++tries) {
    const std::uint32_t a = random.Below(points);
    const std::uint32_t b = random.Below(points);
    const NetworkEdge edge{std::min(a, b), std::max(a, b)};
    if (a != b && std::find(edges.begin(), edges.end(), edge) == edges.end()) {
      edges.push_back(edge);
    }
  }
  return edges;
}

inline double RandomIn(double low, double high, SplitMix64& random) {
  return low + (high - low) * random.Uniform();
}

inline AmnProblem RandomProblem(std::uint32_t points,
                                int classes,
                                const std::vector<NetworkEdge>& edges,
                                SplitMix64& random) {
  AmnProblem problem;
  problem.node_scores.resize(points, classes);
  for (double& score : problem.node_scores.reshaped()) score = RandomIn(-1.0, 1.0, random);
  problem.edge_scores.resize(classes);
  for (double& score : problem.edge_scores) score = RandomIn(0.0, 1.5, random);
  problem.edges = edges;
  return problem;
}

// The highest score of all labelings.
inline double BestScoreByEnumeration(const AmnProblem& problem) {
  std::vector<ClassIndex> labels(problem.points(), 0);
  double best = Score(problem, labels);
  while (true) {
    std::size_t i = 0;
    while (i < labels.size() && ++labels[i] == problem.classes()) labels[i++] = 0;
    if (i == labels.size()) return best;
    best = std::max(best, Score(problem, labels));
  }
}

// The same by trying labels point after point, as long as what is left could still make it the
// best: for a dozen points of four classes.
class Branching {
 public:
  explicit Branching(const AmnProblem& problem)
      : problem_(problem), labels_(problem.points(), 0), left_(problem.points() + 1, 0.0) {
    for (std::size_t i = problem.points(); i-- > 0;) {
      left_[i] = left_[i + 1] + problem.node_scores.row(static_cast<Eigen::Index>(i)).maxCoeff();
      for (const NetworkEdge& edge : problem.edges) {
        if (edge.j == i) left_[i] += problem.edge_scores.maxCoeff();
      }
    }
  }

  double Best() {
    best_ = Score(problem_, labels_);
    Try(0, 0.0);
    return best_;
  }

 private:
  void Try(std::size_t i, double score) {
    if (score + left_[i] <= best_) return;
    if (i == labels_.size()) {
      best_ = score;
      return;
    }
    for (std::size_t k = 0; k < problem_.classes(); ++k) {
      labels_[i] = static_cast<ClassIndex>(k);
      double gain =
          problem_.node_scores(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      for (const NetworkEdge& edge : problem_.edges) {
        if (edge.j == i && labels_[edge.i] == k) {
          gain += problem_.edge_scores[static_cast<Eigen::Index>(k)];
        }
      }
      Try(i + 1, score + gain);
    }
  }

  const AmnProblem& problem_;
  std::vector<ClassIndex> labels_;
  std::vector<double> left_;  // the most that points from here on can add
  double best_ = 0.0;
};

inline double BestScoreByBranching(const AmnProblem& problem) { return Branching(problem).Best(); }

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CLASSIFICATION_AMN_RANDOM_NETWORKS_H_
