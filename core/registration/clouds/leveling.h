// Finds the floor of a scan whose sensor was not level.
#ifndef STRATA_CORE_REGISTRATION_CLOUDS_LEVELING_H_
#define STRATA_CORE_REGISTRATION_CLOUDS_LEVELING_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

struct LevelingOptions {
  double max_tilt_rad = 0.35;  // of the floor's normal to z; in (0, 1]
  double thickness_m = 0.05;   // points within ± this belong to the plane; in [0.001, 1]
  int hypotheses = 500;        // planes tried at most; in [10, 100000]
  double min_support = 0.05;   // less is no floor; in (0, 1]

  absl::Status Validate() const;
};

struct Leveling {
  // Turns the scan's frame level: R_level_scan * p has the floor's normal along +z. The smallest
  // such rotation; heading is kept.
  Eigen::Matrix3d R_level_scan = Eigen::Matrix3d::Identity();
  double tilt_rad = 0.0;   // how far that is
  double floor_z_m = 0.0;  // height of the floor in the level frame, relative to the cloud's origin
  double support = 0.0;    // share of the points on the floor, in [0, 1]
};

// The dominant plane whose normal is within `max_tilt_rad` of z, within 100 m of the sensor: random
// triples, most points of a space-thinned cloud win (near surfaces would outvote large ones by
// their density), then least-squares fits to them. A pure function. NOT_FOUND when no such plane
// has `min_support`; INVALID_ARGUMENT for invalid options.
absl::StatusOr<Leveling> LevelByFloor(const PointCloud& cloud, const LevelingOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_CLOUDS_LEVELING_H_
