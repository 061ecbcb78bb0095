// A path for each goal that somebody publishes.
#ifndef STRATA_CLIENT_ROS2_GOAL_PLANNER_H_
#define STRATA_CLIENT_ROS2_GOAL_PLANNER_H_

#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Core>

#include "client/formats/bags/ros_messages.h"
#include "client/ros2/node.h"
#include "client/ros2/server_link.h"
#include "client/ros2/talk.h"
#include "client/ros2/where.h"
#include "core/api/database.h"
#include "core/world/plan.h"

namespace strata::ros2 {

// A thread: from the robot's place at that moment to the goal, by the map's profile, and again
// where the map changes so that the path no longer holds, until the robot is there. Where there is
// no way the path is empty, and the reason is said.
class GoalPlanner {
 public:
  struct Options {
    std::string map, profile;
    InferredAs inferred = InferredAs::kIgnore;
  };
  // All outlive it.
  GoalPlanner(const Options& options,
              const ServerLink& link,
              const Where& where,
              const Entity& writer,
              Talk& talk);
  ~GoalPlanner();
  GoalPlanner(const GoalPlanner&) = delete;
  GoalPlanner& operator=(const GoalPlanner&) = delete;

  // In any frame that is known; one that waits gives way to it.
  void Put(const RosPose& goal);

 private:
  // What it is driven to, and by which path.
  struct Drive {
    RosPose goal;
    bool planned = false;
    PathQuery path = {};
    Eigen::Vector3d to = Eigen::Vector3d::Zero();
    std::uint64_t changes = 0;  // of the map that the path was looked at with
  };

  void Loop();
  // Ends what there is no more to do for.
  void Follow(std::optional<Drive>& drive);
  absl::Status Plan(Drive& drive);
  // OK while the path holds.
  absl::Status Check(Drive& drive) const;
  absl::StatusOr<PlanResult> PathTo(api::Database& database,
                                    const RobotProfile& profile,
                                    const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& to) const;

  const Options options_;
  const ServerLink& link_;
  const Where& where_;
  const Entity& writer_;
  Talk& talk_;
  absl::Mutex mutex_;
  std::optional<RosPose> goal_ ABSL_GUARDED_BY(mutex_);
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_GOAL_PLANNER_H_
