#include "core/classification/amn.h"

namespace strata {

AmnProblem MakeAmnProblem(const AmnWeights& weights,
                          const FeatureMatrix& features,
                          std::span<const NetworkEdge> edges) {
  AmnProblem problem;
  problem.node_scores = features.cast<double>() * weights.node.transpose();
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
