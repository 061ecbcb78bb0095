// A robot of ROS 2 and a map, side by side: what the robot publishes goes into the map, what the
// map knows goes to the robot.
#ifndef STRATA_CLIENT_ROS2_BRIDGE_H_
#define STRATA_CLIENT_ROS2_BRIDGE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/ros2/follower.h"
#include "client/ros2/intake.h"
#include "client/ros2/keeper.h"
#include "client/ros2/options.h"
#include "client/ros2/talk.h"
#include "client/sdk/spool.h"
#include "core/common/stop.h"

namespace strata::ros2 {

// What a run came to.
struct Summary {
  std::string trajectory;
  IntakeCounts intake;
  KeeperCounts kept;
  FollowerStatus followed;
  SpoolStatus spool;
};

// Runs until `stop`; a server that is away or comes back is nothing to end for. Errors of the
// spool, of the token and of the network it begins with; NOT_FOUND where a server answers that has
// no such map. REQUIRES: ValidateOptions.
absl::StatusOr<Summary> RunBridge(const Options& options, const Stop& stop, Talk& talk);

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_BRIDGE_H_
