#include "client/ros2/goal_planner.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"

#include "client/ros2/messages.h"
#include "client/ros2/world_publisher.h"
#include "core/common/status.h"

namespace strata::ros2 {
namespace {

PlanEndpoint EndpointAt(const Eigen::Vector3d& p, double z_m) {
  return {.x_m = p.x(), .y_m = p.y(), .z_m = z_m};
}

}  // namespace

GoalPlanner::GoalPlanner(const Options& options,
                         const ServerLink& link,
                         const Where& where,
                         const Entity& writer,
                         Talk& talk)
    : options_(options), link_(link), where_(where), writer_(writer), talk_(talk), thread_([this] {
        Loop();
      }) {}

GoalPlanner::~GoalPlanner() {
  {
    absl::MutexLock lock(&mutex_);
    ending_ = true;
  }
  thread_.join();
}

void GoalPlanner::Put(const RosPose& goal) {
  absl::MutexLock lock(&mutex_);
  goal_ = goal;
}

void GoalPlanner::Loop() {
  while (true) {
    RosPose goal;
    {
      absl::MutexLock lock(&mutex_);
      const auto due = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
        return ending_ || goal_.has_value();
      };
      mutex_.Await(absl::Condition(&due));
      if (ending_) return;
      goal = *std::exchange(goal_, std::nullopt);
    }
    const absl::Status planned = Plan(goal);
    if (!planned.ok()) talk_.Say(absl::StrCat("no path: ", planned.message()));
  }
}

absl::Status GoalPlanner::Plan(const RosPose& goal) {
  api::Database* const database = link_.database();
  if (database == nullptr) return absl::UnavailableError("no stratad has answered yet");
  const std::optional<Pose> T_map_base = where_.T_map_base();
  if (!T_map_base.has_value()) return absl::NotFoundError("no pose of the robot has come yet");
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_goal, where_.InMap(goal.header.frame));
  const Eigen::Vector3d to = T_map_goal * Eigen::Vector3d(goal.position_m.data());
  STRATA_ASSIGN_OR_RETURN(const PlanResult path, PathTo(*database, T_map_base->translation(), to));
  STRATA_RETURN_IF_ERROR(
      WritePath(writer_, {where_.map_frame(), where_.stamp_ns()}, path.waypoints));
  if (!path.found()) return absl::NotFoundError(path.message);
  talk_.Say(absl::StrFormat("path of %.1f m to %.2f, %.2f, %.2f in %.0f ms",
                            path.length_m,
                            to.x(),
                            to.y(),
                            to.z(),
                            path.elapsed_ms));
  return absl::OkStatus();
}

absl::StatusOr<PlanResult> GoalPlanner::PathTo(api::Database& database,
                                               const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& to) {
  PlanQuery query;
  STRATA_ASSIGN_OR_RETURN(query.profile,
                          FindProfile(database, link_.call(), options_.map, options_.profile));
  query.from = EndpointAt(from, from.z());
  // RViz points at the plane of height 0, whatever storey it shows: the robot's then, if there is
  // ground at its height.
  if (to.z() == 0.0) {
    query.to = EndpointAt(to, from.z());
    const absl::StatusOr<PlanResult> here =
        database.planning().PlanPath(link_.call(), options_.map, query);
    if (!here.ok() || here->reason != PlanReason::kGoalNotOnSurface) return here;
  }
  query.to = EndpointAt(to, to.z());
  return database.planning().PlanPath(link_.call(), options_.map, query);
}

}  // namespace strata::ros2
