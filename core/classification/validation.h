// How good a classifier is on clouds whose labels are known, and how good its kind would be.
#ifndef STRATA_CORE_CLASSIFICATION_VALIDATION_H_
#define STRATA_CORE_CLASSIFICATION_VALIDATION_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

#include "core/classification/classifier.h"
#include "core/classification/evaluation.h"
#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"

namespace strata {

// Classifies the cloud and counts its points by the class that its label names (row) and the class
// given (column), both by their place in `classes`. Points whose label names none of `classes` are
// not counted. REQUIRES: `classes` has the id of every class of `classifier`.
absl::StatusOr<ConfusionMatrix> EvaluateClassifier(const Classifier& classifier,
                                                   const PointCloud& cloud,
                                                   const std::vector<ClassName>& classes,
                                                   const Stop& stop);

// k-fold validation: every cloud is classified once, by a classifier that learned from the clouds
// of the other folds (DrawFolds with seed 1); points of one cloud are never on both sides. A class
// that is in one fold only cannot be learned for it, and counts as missed. INVALID_ARGUMENT unless
// 2 ≤ folds ≤ groups; otherwise errors as TrainClassifier(). `groups`: of every cloud, in [0,
// number of groups); clouds of one group are left out together.
absl::StatusOr<ConfusionMatrix> CrossValidate(const std::vector<PointCloud>& clouds,
                                              std::span<const std::size_t> groups,
                                              const std::vector<ClassName>& classes,
                                              const TrainingOptions& options,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop);

// The same over the clouds of a source, one for each of `groups`; it is gone through several times.
absl::StatusOr<ConfusionMatrix> CrossValidate(std::span<const std::size_t> groups,
                                              CloudSource source,
                                              const std::vector<ClassName>& classes,
                                              const TrainingOptions& options,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_VALIDATION_H_
