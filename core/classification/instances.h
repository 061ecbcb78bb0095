// Training points kept as they are: the nearest-neighbour classifier (thesis 8.4) and the feature
// transform of instance-based networks (9.4).
#ifndef STRATA_CORE_CLASSIFICATION_INSTANCES_H_
#define STRATA_CORE_CLASSIFICATION_INSTANCES_H_

#include <cstddef>
#include <memory>
#include <vector>

#include "core/classification/labelled_features.h"

namespace strata {

// A kd-tree a class, in the space of features (9.4.3). Immutable, thread-safe.
class Instances {
 public:
  // `data` must be valid, and outlive the instances.
  explicit Instances(const LabelledFeatures& data);
  ~Instances();

  // τ of eq. 9.9: a row a point, the distances to the `count` nearest instances of class 0, rising,
  // then of class 1 and so on. A class with fewer instances repeats its farthest.
  FeatureMatrix Distances(const FeatureMatrix& features, std::size_t count) const;
  // The same of the training points, each left out of its own neighbours: its distance 0 would
  // betray its label. A class that has no other instance is as far as the farthest of all.
  FeatureMatrix DistancesWithin(std::size_t count) const;

  // Shares of the classes among the `count` nearest instances (eq. 8.5).
  ScoreMatrix Votes(const FeatureMatrix& features, std::size_t count) const;

 private:
  class Tree;
  const LabelledFeatures& data_;
  std::vector<std::unique_ptr<Tree>> trees_;  // of every class
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_INSTANCES_H_
