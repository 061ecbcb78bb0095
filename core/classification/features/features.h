// Numbers that say what is around a point, by which classifiers tell classes apart.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_FEATURES_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_FEATURES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/classification/features/labelled_features.h"
#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"

namespace strata {

enum class FeatureSet : std::uint8_t {  // stored in models
  // Linearity, planarity, scattering, verticality, the direction of the longest axis and how far
  // the neighbours reach, at several scales; height above the lowest patch around; what is above
  // and below in upright columns of two widths.
  kShape = 1,
  // The thesis' features of facades (9.3.4): histogram of the angles between the neighbours'
  // normals and that of the wall, or of the ground where there is no wall; neighbours in front of,
  // in and behind the plane through the point; normalised height.
  kWall = 2,
  // Spin images of 5 × 10 bins (9.4.3; Johnson 1997): roots of the shares of the points around.
  kSpin = 3,
};

struct PointFeatureOptions {
  FeatureSet set = FeatureSet::kShape;
  int neighbours = 16;  // in [4, 64]
  // kShape: looked at in the cloud itself, and then in clouds thinned to voxels of this edge [m],
  // twice as wide each time. In [1, 8]; in [0.01, 10].
  int scales = 4;
  double voxel_m = 0.15;
  double max_height_m = 15.0;    // h_max, in (0, 1000]
  double plane_side_m = 0.05;    // ε, in (0, 1]
  double wall_distance_m = 0.5;  // points farther from a wall are not of it, in (0, 10]
  double spin_radius_m = 0.0;    // 0: ten times the median spacing of the cloud; in [0, 100]

  absl::Status Validate() const;
  friend bool operator==(const PointFeatureOptions&, const PointFeatureOptions&) = default;
};

// "shape", "wall", "spin".
absl::string_view ToString(FeatureSet set);
absl::StatusOr<FeatureSet> FeatureSetFromName(absl::string_view name);

// One for every column, the constant 1 last.
std::vector<std::string> FeatureNames(const PointFeatureOptions& options);

// One row a point of the cloud, in its order; rows of points that are not finite are zero but for
// the constant. Values are about 0 to 1. z must be up. INVALID_ARGUMENT for bad options; errors are
// also those of `stop`. Deterministic.
absl::StatusOr<FeatureMatrix> ComputeFeatures(const PointCloud& cloud,
                                              const PointFeatureOptions& options,
                                              const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_FEATURES_H_
