#include "core/classification/amn/amn.h"

#include <algorithm>

namespace strata {
namespace {

constexpr Eigen::Index kBlock = 4096;

}  // namespace

AmnProblem MakeAmnProblem(const AmnWeights& weights,
                          const FeatureMatrix& features,
                          std::span<const NetworkEdge> edges) {
  AmnProblem problem;
  problem.node_scores.resize(features.rows(), weights.node.rows());
  // Block by block: all features as doubles would be the largest thing in memory.
  for (Eigen::Index begin = 0; begin < features.rows(); begin += kBlock) {
    const Eigen::Index rows = std::min(kBlock, features.rows() - begin);
    problem.node_scores.middleRows(begin, rows).noalias() =
        features.middleRows(begin, rows).cast<double>() * weights.node.transpose();
  }
  problem.edges = edges;
  problem.edge_scores = weights.edge;
  return problem;
}

double Score(const AmnProblem& problem, std::span<const ClassIndex> labels) {
  double score = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    score += problem.node_scores(static_cast<Eigen::Index>(i), labels[i]);
  }
  for (const NetworkEdge& edge : problem.edges) {
    if (labels[edge.i] == labels[edge.j]) score += problem.edge_scores[labels[edge.i]];
  }
  return score;
}

}  // namespace strata
