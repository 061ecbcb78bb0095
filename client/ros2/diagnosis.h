// How well it is known where the robot is, for /diagnostics.
#ifndef STRATA_CLIENT_ROS2_DIAGNOSIS_H_
#define STRATA_CLIENT_ROS2_DIAGNOSIS_H_

#include "absl/time/time.h"

#include "client/ros2/follower.h"
#include "client/ros2/messages.h"

namespace strata::ros2 {

// OK while the robot is tracked. Else map -> odom is as its own scans have it where it `maps` and
// `located` says that it knows where it began (WARN), or what it was last (ERROR).
Diagnosis DiagnosisOf(const FollowerStatus& status, bool maps, bool located, absl::Time now);

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_DIAGNOSIS_H_
