// The Bayes classifier with a Gaussian a class (thesis 8.3).
#ifndef STRATA_CORE_CLASSIFICATION_LEARNERS_NAIVE_BAYES_H_
#define STRATA_CORE_CLASSIFICATION_LEARNERS_NAIVE_BAYES_H_

#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/classification/features/labelled_features.h"

namespace strata {

struct NaiveBayesOptions {
  // Every class's covariance becomes (1 − share) Σ_k + share · diag(Σ) of all points, plus a
  // millionth of it: classes with few points, and features that are constant within a class, would
  // make it singular. In [0, 1].
  double shared_share = 0.1;
  bool uniform_prior = false;  // or the share of points in training
};

// Immutable values of a model.
struct NaiveBayes {
  Eigen::MatrixXd mean;                     // μ_k: one row a class
  std::vector<Eigen::MatrixXd> covariance;  // Σ_k
  Eigen::VectorXd log_prior;
};

// INVALID_ARGUMENT for data that Validate() refuses or a share out of its range.
absl::StatusOr<NaiveBayes> LearnNaiveBayes(const LabelledFeatures& data,
                                           const NaiveBayesOptions& options);

// log p(x_n | y = k) + log p(y = k), eq. 8.2 and 8.3.
ScoreMatrix NaiveBayesScores(const NaiveBayes& model, const FeatureMatrix& features);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_LEARNERS_NAIVE_BAYES_H_
