// How high points are above what is lowest around them.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_GROUND_HEIGHT_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_GROUND_HEIGHT_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

namespace strata {

// Heights [m] of `points` (z up) above the lowest patch of their local map within 3 m; 0 for points
// below it, and where no patch is. Points must be finite. Errors are those of BuildMlsMap.
absl::StatusOr<std::vector<float>> HeightsAboveLowest(std::span<const Eigen::Vector3f> points);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_GROUND_HEIGHT_H_
