// How good labels are, against ones that are known to be right.
#ifndef STRATA_CORE_CLASSIFICATION_EVALUATION_H_
#define STRATA_CORE_CLASSIFICATION_EVALUATION_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/classification/features/labelled_features.h"

namespace strata {

// Counts points by true class (row) and class given (column).
class ConfusionMatrix {
 public:
  explicit ConfusionMatrix(std::size_t classes)
      : classes_(classes), counts_(classes * classes, 0) {}

  void Add(ClassIndex truth, ClassIndex given, std::uint64_t points = 1) {
    counts_[truth * classes_ + given] += points;
  }
  // Both of equal length.
  void Add(std::span<const ClassIndex> truth, std::span<const ClassIndex> given);
  // `other` is of the same classes.
  void Add(const ConfusionMatrix& other);

  std::size_t classes() const { return classes_; }
  std::uint64_t count(std::size_t truth, std::size_t given) const {
    return counts_[truth * classes_ + given];
  }
  std::uint64_t total() const;

  // Share of all points that are right; 0 without points.
  double Accuracy() const;
  // Share of the points given the class that is of it; nullopt if none was.
  std::optional<double> Precision(std::size_t k) const;
  // Share of the points of the class that was found; nullopt if there is none.
  std::optional<double> Recall(std::size_t k) const;
  // Intersection over union; nullopt if no point is of the class or was given it.
  std::optional<double> Iou(std::size_t k) const;
  // Over the classes that have one.
  double MeanIou() const;

 private:
  std::uint64_t Row(std::size_t k) const;
  std::uint64_t Column(std::size_t k) const;

  std::size_t classes_;
  std::vector<std::uint64_t> counts_;
};

// For k-fold validation: which fold every group (a scan, a region) is left out in, in [0, folds);
// drawn so that folds have equally many groups, to one. Points of one group always stay together.
std::vector<std::size_t> DrawFolds(std::size_t groups, std::size_t folds, std::uint64_t seed);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_EVALUATION_H_
