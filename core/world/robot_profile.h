// What "traversable" means for whom.
#ifndef STRATA_CORE_WORLD_ROBOT_PROFILE_H_
#define STRATA_CORE_WORLD_ROBOT_PROFILE_H_

#include "absl/status/status.h"

namespace strata {

// A robot as the planner sees it: an upright cylinder that stands on surfaces.
struct RobotProfile {
  double radius_m = 0.3;        // of the footprint; in [0, 10]
  double height_m = 1.0;        // clearance it needs above a surface; in [0.01, 100]
  double max_step_m = 0.15;     // highest step up or down between neighbouring cells; in [0, 10]
  double max_slope_rad = 0.35;  // steepest ground; in [0, 1.5]
  double max_gap_m =
      0.3;  // longest stretch of unobserved cells it may cross between fitting surfaces; [0, 10]
  double max_roughness_m =
      0.08;  // largest standard deviation of surfaces around their local plane; in (0, 10]

  friend bool operator==(const RobotProfile&, const RobotProfile&) = default;
};

// INVALID_ARGUMENT naming every field that is not finite or out of its range.
absl::Status ValidateRobotProfile(const RobotProfile& profile);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_ROBOT_PROFILE_H_
