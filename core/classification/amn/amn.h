// Associative Markov networks (thesis 9.2; Taskar, Chatalbashev, Koller 2004): how well labels fit
// points and neighbours.
//
// The logarithm of eq. 9.2 without its partition function: Σ_i w_n^k · x_i + Σ_ij w_e^k x_ij with k
// the label of i, and of both i and j. Edge features are one constant (9.4.3), so that w_e^k is the
// reward of two neighbours that are both of class k; neighbours that differ get none (Potts).
#ifndef STRATA_CORE_CLASSIFICATION_AMN_AMN_H_
#define STRATA_CORE_CLASSIFICATION_AMN_AMN_H_

#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "core/classification/amn/network.h"
#include "core/classification/features/labelled_features.h"

namespace strata {

struct AmnWeights {
  Eigen::MatrixXd node;  // w_n: one row a class, one column a feature
  Eigen::VectorXd edge;  // w_e ≥ 0: one a class

  std::size_t classes() const { return static_cast<std::size_t>(node.rows()); }
};

// A network whose labels are wanted.
struct AmnProblem {
  ScoreMatrix node_scores;  // w_n^k · x_i
  std::span<const NetworkEdge> edges;
  Eigen::VectorXd edge_scores;  // w_e^k ≥ 0

  std::size_t points() const { return static_cast<std::size_t>(node_scores.rows()); }
  std::size_t classes() const { return static_cast<std::size_t>(node_scores.cols()); }
};

// The scores of `features` under `weights`.
AmnProblem MakeAmnProblem(const AmnWeights& weights,
                          const FeatureMatrix& features,
                          std::span<const NetworkEdge> edges);

// What inference maximises.
double Score(const AmnProblem& problem, std::span<const ClassIndex> labels);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_AMN_H_
