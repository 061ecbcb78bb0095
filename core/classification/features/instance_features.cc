#include "core/classification/features/instance_features.h"

namespace strata {

FeatureMatrix InstanceFeatures(FeatureMatrix distances) {
  for (Eigen::Index i = 0; i < distances.rows(); ++i) {
    const float mean = distances.row(i).mean();
    if (mean > 0.0F) distances.row(i) /= mean;
  }
  distances.conservativeResize(Eigen::NoChange, distances.cols() + 1);
  distances.rightCols(1).setOnes();
  return distances;
}

}  // namespace strata
