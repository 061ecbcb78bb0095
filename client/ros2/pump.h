// What a robot publishes, as it comes: to where it is needed, and without waiting for anything.
#ifndef STRATA_CLIENT_ROS2_PUMP_H_
#define STRATA_CLIENT_ROS2_PUMP_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "client/ros2/follower.h"
#include "client/ros2/goal_planner.h"
#include "client/ros2/intake.h"
#include "client/ros2/keeper.h"
#include "client/ros2/listener.h"
#include "client/ros2/node.h"
#include "client/ros2/options.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/talk.h"
#include "client/ros2/where.h"
#include "client/sdk/spool.h"
#include "core/common/stop.h"

namespace strata::ros2 {

// Reads on the thread that runs it, and says on /tf where the odometry is. Not thread-safe.
class Pump {
 public:
  // All outlive it.
  struct Parts {
    Node& node;
    const Entity& transform_writer;  // none: nothing is said on /tf
    const Entity& diagnosis_writer;
    PoseBook& book;
    Keeper* keeper;      // null: nothing is kept,
    const Spool* spool;  // and there is none
    Follower& follower;
    GoalPlanner& planner;
    const Where& where;
    Talk& talk;
  };
  // REQUIRES: ValidateOptions.
  Pump(const Options& options, const Parts& parts);

  absl::Status Begin();
  // Until `stop`.
  absl::Status Run(const Stop& stop);
  const IntakeCounts& counts() const { return intake_.counts(); }

 private:
  bool by_transforms() const;
  // Looks at who publishes.
  absl::Status Follow();
  void Read();
  void ReadTransforms(const Entity& reader, const std::string& topic, bool fixed);
  void ReadPoses();
  void ReadClouds();
  void ReadGoals();
  void ReadGuesses();
  absl::StatusOr<Pose> PoseInMap(const RosPose& pose) const;
  void Keep(absl::Time now);
  void WarnOfRival(const std::vector<RosPose>& transforms);
  void SayWhere();
  void Diagnose(absl::Time now);
  // To people: what is missing, and what came of the rest.
  void ReportMissing();
  void ReportClouds();
  void ReportSpool(const SpoolStatus& spool);
  void Tell(const std::string& topic, const absl::Status& status);

  const Options& options_;
  const Parts parts_;
  Listener clouds_, poses_, goals_, guesses_;
  Entity transforms_, static_transforms_;
  Intake intake_;
  absl::Time tracked_;  // last
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_PUMP_H_
