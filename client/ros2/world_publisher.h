// The floor the robot is on and the surfaces around it, published when they change.
#ifndef STRATA_CLIENT_ROS2_WORLD_PUBLISHER_H_
#define STRATA_CLIENT_ROS2_WORLD_PUBLISHER_H_

#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/formats/grid_writer.h"
#include "client/ros2/node.h"
#include "client/ros2/server_link.h"
#include "client/ros2/talk.h"
#include "client/ros2/where.h"
#include "core/api/database.h"
#include "core/common/stop.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata::ros2 {

// The map's profile of that name. NOT_FOUND.
absl::StatusOr<RobotProfile> FindProfile(api::Database& database,
                                         const api::Call& call,
                                         const std::string& map,
                                         const std::string& profile);

// A thread.
class WorldPublisher {
 public:
  struct Options {
    std::string map, profile;
    InferredAs inferred = InferredAs::kIgnore;
  };
  // All outlive it.
  WorldPublisher(const Options& options,
                 const ServerLink& link,
                 const Where& where,
                 const Entity& grid_writer,
                 const Entity& surface_writer,
                 Talk& talk);
  ~WorldPublisher();
  WorldPublisher(const WorldPublisher&) = delete;
  WorldPublisher& operator=(const WorldPublisher&) = delete;

 private:
  void Loop();
  // Whether there is anything to look at again.
  bool Due(const Eigen::Vector3d& place) const;
  absl::Status Publish(api::Database& database, const Eigen::Vector3d& place);
  absl::Status PublishFloor(api::Database& database, const Eigen::Vector3d& place);
  absl::Status PublishSurfaces(api::Database& database, const Eigen::Vector3d& place);

  const Options options_;
  const ServerLink& link_;
  const Where& where_;
  const Entity& grid_writer_;
  const Entity& surface_writer_;
  Talk& talk_;
  const Stop stop_;
  std::optional<Eigen::Vector3d> place_;  // where it looked last
  std::uint64_t changes_ = 0;             // that it saw then
  double cell_size_m_ = 0.0;              // of the map, once known
  OccupancyGrid grid_;                    // published last
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_WORLD_PUBLISHER_H_
