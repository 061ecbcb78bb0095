// The parts of core/classification/features/features.h, one a set. Points are finite, options
// valid. The last column is left for the constant. Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_FEATURE_COLUMNS_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_FEATURE_COLUMNS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "core/classification/features/features.h"

namespace strata {

std::vector<std::string> ShapeFeatureNames(const PointFeatureOptions& options);
absl::StatusOr<FeatureMatrix> ShapeFeatures(const PointCloud& cloud,
                                            const PointFeatureOptions& options,
                                            const Stop& stop);

std::vector<std::string> WallFeatureNames();
absl::StatusOr<FeatureMatrix> WallFeatures(const PointCloud& cloud,
                                           const PointFeatureOptions& options,
                                           const Stop& stop);

std::vector<std::string> SpinFeatureNames();
absl::StatusOr<FeatureMatrix> SpinFeatures(const PointCloud& cloud,
                                           const PointFeatureOptions& options,
                                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_FEATURE_COLUMNS_H_
