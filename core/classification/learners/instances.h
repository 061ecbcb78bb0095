// Training points kept as they are: the nearest-neighbour classifier (thesis 8.4) and the feature
// transform of instance-based networks (9.4).
#ifndef STRATA_CORE_CLASSIFICATION_LEARNERS_INSTANCES_H_
#define STRATA_CORE_CLASSIFICATION_LEARNERS_INSTANCES_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/classification/features/labelled_features.h"

namespace strata {

// Held against all queries, block by block: in the some forty dimensions of features a kd-tree
// (9.4.3) looks at nearly every instance too, one by one. Immutable, thread-safe.
class Instances {
 public:
  // `data` must be valid, and outlive the instances.
  explicit Instances(const LabelledFeatures& data);

  // τ of eq. 9.9: a row a point, the distances to the `count` nearest instances of class 0, rising,
  // then of class 1 and so on. A class with fewer instances repeats its farthest.
  FeatureMatrix Distances(const FeatureMatrix& features, std::size_t count) const;
  // The same of the training points, each left out of its own neighbours: its distance 0 would
  // betray its label. A class that has no other instance is as far as the farthest of all.
  FeatureMatrix DistancesWithin(std::size_t count) const;

  // Shares of the classes among the `count` nearest instances (eq. 8.5).
  ScoreMatrix Votes(const FeatureMatrix& features, std::size_t count) const;

 private:
  struct OfClass {
    FeatureMatrix features;
    Eigen::RowVectorXf squared_norms;
    std::vector<Eigen::Index> rows;  // in the data

    // The place of a row of the data among `rows`; their number if it is none of them.
    std::size_t PlaceOf(Eigen::Index row) const;
  };

  // As Distances(), but negative where a class has fewer instances. `within`: `features` are those
  // of the data.
  FeatureMatrix Nearest(const FeatureMatrix& features, std::size_t count, bool within) const;

  const LabelledFeatures& data_;
  std::vector<OfClass> classes_;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_LEARNERS_INSTANCES_H_
