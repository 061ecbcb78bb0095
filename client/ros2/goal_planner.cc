#include "client/ros2/goal_planner.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "client/ros2/messages.h"
#include "client/ros2/world_publisher.h"
#include "core/common/status.h"

namespace strata::ros2 {
namespace {

// How often it looks whether the map has changed.
constexpr absl::Duration kLookAtPath = absl::Milliseconds(500);
// Nearer than this the robot is where it was to go.
constexpr double kThereM = 0.5;

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
  std::optional<Drive> drive;
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      const auto due = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
        return ending_ || goal_.has_value();
      };
      mutex_.AwaitWithTimeout(absl::Condition(&due),
                              drive.has_value() ? kLookAtPath : absl::InfiniteDuration());
      if (ending_) return;
      if (goal_.has_value()) drive = Drive{*std::exchange(goal_, std::nullopt)};
    }
    Follow(drive);
  }
}

void GoalPlanner::Follow(std::optional<Drive>& drive) {
  if (!drive.has_value()) return;
  if (drive->planned) {
    const std::optional<Pose> T_map_base = where_.T_map_base();
    if (!T_map_base.has_value()) return;
    const double left_m = (T_map_base->translation() - drive->to).head<2>().norm();
    if (left_m < kThereM) {
      drive.reset();
      return;
    }
    const absl::Status holds = Check(*drive);
    if (holds.ok()) return;
    talk_.Say(absl::StrCat("the path no longer holds: ", holds.message()));
  }
  const absl::Status planned = Plan(*drive);
  if (planned.ok()) return;
  talk_.SayNew("path", absl::StrCat("no path: ", planned.message()));
  // A server that is away may come back.
  if (!absl::IsUnavailable(planned)) drive.reset();
}

absl::Status GoalPlanner::Plan(Drive& drive) {
  api::Database* const database = link_.database();
  if (database == nullptr) return absl::UnavailableError("no stratad has answered yet");
  const std::optional<Pose> T_map_base = where_.T_map_base();
  if (!T_map_base.has_value()) {
    return absl::NotFoundError("where the robot is in the map is not known yet");
  }
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_goal, where_.InMap(drive.goal.header.frame));
  drive.to = T_map_goal * Eigen::Vector3d(drive.goal.position_m.data());
  drive.changes = link_.changes();
  drive.path.inferred = options_.inferred;
  STRATA_ASSIGN_OR_RETURN(drive.path.profile,
                          FindProfile(*database, link_.call(), options_.map, options_.profile));
  STRATA_ASSIGN_OR_RETURN(
      const PlanResult path,
      PathTo(*database, drive.path.profile, T_map_base->translation(), drive.to));
  STRATA_RETURN_IF_ERROR(
      WritePath(writer_, {where_.map_frame(), where_.stamp_ns()}, path.waypoints));
  if (!path.found()) return absl::NotFoundError(path.message);
  drive.path.waypoints = path.waypoints;
  drive.planned = true;
  talk_.SayNew("path", "");
  talk_.Say(absl::StrFormat("path of %.1f m to %.2f, %.2f, %.2f",
                            path.length_m,
                            path.waypoints.back().x(),
                            path.waypoints.back().y(),
                            path.waypoints.back().z()));
  return absl::OkStatus();
}

absl::Status GoalPlanner::Check(Drive& drive) const {
  const std::uint64_t changes = link_.changes();
  if (changes == drive.changes) return absl::OkStatus();
  const absl::StatusOr<PathCheck> check =
      link_.database()->planning().CheckPath(link_.call(), options_.map, drive.path);
  if (!check.ok()) return absl::OkStatus();  // asked again
  drive.changes = changes;
  drive.path.known = *check;
  return check->valid ? absl::OkStatus() : absl::FailedPreconditionError(check->message);
}

absl::StatusOr<PlanResult> GoalPlanner::PathTo(api::Database& database,
                                               const RobotProfile& profile,
                                               const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& to) const {
  PlanQuery query;
  query.profile = profile;
  query.inferred = options_.inferred;
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
