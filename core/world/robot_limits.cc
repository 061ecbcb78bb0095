#include "core/world/robot_limits.h"

namespace strata {

TraversabilityLimits LimitsOf(const RobotProfile& profile) {
  return {.max_slope_rad = profile.max_slope_rad,
          .max_step_m = profile.max_step_m,
          .max_roughness_m = profile.max_roughness_m,
          .clearance_m = profile.height_m};
}

}  // namespace strata
