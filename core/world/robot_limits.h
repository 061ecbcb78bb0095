// What ground a robot can take.
#ifndef STRATA_CORE_WORLD_ROBOT_LIMITS_H_
#define STRATA_CORE_WORLD_ROBOT_LIMITS_H_

#include "core/mls/traversability.h"
#include "core/world/robot_profile.h"

namespace strata {

// What surfaces are judged by for the robot of that profile.
TraversabilityLimits LimitsOf(const RobotProfile& profile);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_ROBOT_LIMITS_H_
