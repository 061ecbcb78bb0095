// The linear relaxation of inference in a network (thesis eq. 9.8, with Σ_k y_i^k = 1 for every i):
// what inference and learning are held against.
#ifndef STRATA_TESTS_CORE_CLASSIFICATION_AMN_RELAXATION_H_
#define STRATA_TESTS_CORE_CLASSIFICATION_AMN_RELAXATION_H_

#include "absl/status/statusor.h"

#include "core/classification/amn/amn.h"

namespace strata::testing {

// Solved by Clp; for networks of up to some 10,000 variables y_ij^k.
struct AmnRelaxation {
  ScoreMatrix share;       // y_i^k: how much of every point belongs to every class; rows sum to 1
  ScoreMatrix edge_share;  // y_ij^k, a row an edge
  double score = 0.0;      // no labeling has a higher one
};

// RESOURCE_EXHAUSTED if the solver gives up. Whole numbers for two classes (Taskar 2004), maybe
// fractions for more.
absl::StatusOr<AmnRelaxation> RelaxScore(const AmnProblem& problem);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CLASSIFICATION_AMN_RELAXATION_H_
