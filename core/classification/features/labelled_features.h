// Points whose class is known, as every learner takes them.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_LABELLED_FEATURES_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_LABELLED_FEATURES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

namespace strata {

// One row a point.
using FeatureMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
// One row a point, one column a class: the larger, the likelier.
using ScoreMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
// The number of a class in a model, from 0.
using ClassIndex = std::uint16_t;

struct LabelledFeatures {
  FeatureMatrix features;
  std::vector<ClassIndex> labels;  // of every row, < classes
  std::size_t classes = 0;

  std::size_t size() const { return labels.size(); }
};

// INVALID_ARGUMENT naming what is wrong: no points, fewer than two classes or more than 1000, a
// label that is none, a class without a point, a feature that is not finite.
absl::Status Validate(const LabelledFeatures& data);

// The class with the largest score of every row; the first of equal ones.
std::vector<ClassIndex> LargestScores(const ScoreMatrix& scores);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_LABELLED_FEATURES_H_
