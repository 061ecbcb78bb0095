#include "client/ros2/bridge.h"

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "client/formats/bags/cloud_poses.h"
#include "client/formats/bags/ros_messages.h"
#include "client/ros2/follower.h"
#include "client/ros2/goal_planner.h"
#include "client/ros2/keeper.h"
#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/pump.h"
#include "client/ros2/server_link.h"
#include "client/ros2/where.h"
#include "client/ros2/world_publisher.h"
#include "core/common/status.h"

namespace strata::ros2 {
namespace {

struct Writers {
  Entity map, plan, surfaces, pose, diagnosis, transforms;
};

absl::StatusOr<Writers> MakeWriters(Node& node, const Options& options) {
  constexpr RosQos kLatched = {.reliable = true, .transient_local = true, .depth = 1};
  Writers writers;
  STRATA_ASSIGN_OR_RETURN(writers.map,
                          node.MakeWriter(options.map_topic, "nav_msgs/OccupancyGrid", kLatched));
  STRATA_ASSIGN_OR_RETURN(writers.plan,
                          node.MakeWriter(options.plan_topic, "nav_msgs/Path", {.depth = 1}));
  STRATA_ASSIGN_OR_RETURN(writers.surfaces,
                          node.MakeWriter(options.surfaces_topic, kPointCloudType, kLatched));
  STRATA_ASSIGN_OR_RETURN(
      writers.pose,
      node.MakeWriter(options.pose_topic, "geometry_msgs/PoseWithCovarianceStamped", kLatched));
  STRATA_ASSIGN_OR_RETURN(
      writers.diagnosis,
      node.MakeWriter("/diagnostics", "diagnostic_msgs/DiagnosticArray", {.depth = 10}));
  if (!options.no_tf) {
    STRATA_ASSIGN_OR_RETURN(writers.transforms,
                            node.MakeWriter("/tf", "tf2_msgs/TFMessage", {.depth = 100}));
  }
  return writers;
}

PoseBook::Options BookOptions(const Options& options) {
  PoseBook::Options book;
  // Validated before.
  if (absl::StartsWith(options.poses_from, "tf:")) {
    book.transforms = *ParseTransformPoses(options.poses_from);
  }
  book.T_base_cloud = options.mount;
  book.T_map_fixed = options.start.value_or(Pose::Identity());
  book.located = !options.localize && !options.localize_only;
  return book;
}

// Whoever answers must have the map: a name mistyped is noticed now, not after the drive.
absl::Status CheckMap(const Options& options, const ClientOptions& client, Talk& talk) {
  const auto database = Connect(client);
  const absl::Status known =
      database.ok() ? (*database)->maps().Get({}, options.map).status() : database.status();
  if (absl::IsNotFound(known)) {
    return absl::NotFoundError(
        absl::StrCat(known.message(), "; make it: strata map create ", options.map));
  }
  if (!absl::IsUnavailable(known)) return cli::Explained(known, options.server);
  talk.SayNew("server", NobodyAnswers(options.server.server, !options.localize_only));
  return absl::OkStatus();
}

KeeperOptions ScansAsIn(const Options& options, const std::string& trajectory) {
  return {options.map,
          trajectory,
          options.align == "on" ? Alignment::kOn : Alignment::kOff,
          options.deskew == "on"};
}

}  // namespace

absl::StatusOr<Summary> RunBridge(const Options& options, const Stop& stop, Talk& talk) {
  Summary summary;
  summary.trajectory = options.trajectory.empty() ? TrajectoryAt(absl::Now()) : options.trajectory;
  STRATA_ASSIGN_OR_RETURN(const ClientOptions client, cli::ClientOptionsOf(options.server));
  std::unique_ptr<Spool> spool;
  if (!options.localize_only) {
    STRATA_ASSIGN_OR_RETURN(spool, Spool::Open(options.spool));
  }
  STRATA_RETURN_IF_ERROR(CheckMap(options, client, talk));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Node> node, Node::Create(options.domain));
  STRATA_ASSIGN_OR_RETURN(const Writers writers, MakeWriters(*node, options));
  PoseBook book(BookOptions(options));
  const ServerLink link(
      {options.server, client, options.map, summary.trajectory}, spool.get(), talk);
  Where where(book, link, options.map_frame);
  const KeeperOptions scans = ScansAsIn(options, summary.trajectory);
  {
    std::optional<Keeper> keeper;
    if (spool != nullptr) keeper.emplace(scans, book, *spool, talk);
    // Poses that are taken as they are need no better ones.
    Follower follower({.scans = scans, .guess = options.start, .goes_on = options.align == "on"},
                      book,
                      link,
                      where,
                      writers.pose,
                      talk);
    GoalPlanner planner(
        {options.map, options.profile, options.inferred}, link, where, writers.plan, talk);
    const WorldPublisher world({options.map, options.profile, options.inferred},
                               link,
                               where,
                               writers.map,
                               writers.surfaces,
                               talk);
    Pump pump(options,
              {.node = *node,
               .transform_writer = writers.transforms,
               .diagnosis_writer = writers.diagnosis,
               .book = book,
               .keeper = keeper.has_value() ? &*keeper : nullptr,
               .spool = spool.get(),
               .follower = follower,
               .planner = planner,
               .where = where,
               .talk = talk});
    STRATA_RETURN_IF_ERROR(pump.Begin());
    talk.Say(absl::StrCat("listening in domain ",
                          options.domain,
                          spool != nullptr ? absl::StrCat("; trajectory ", summary.trajectory) : "",
                          spool != nullptr ? " of map " : "; map ",
                          options.map));
    const absl::Status ran = pump.Run(stop);
    link.EndCalls();  // or a long search would be waited for
    STRATA_RETURN_IF_ERROR(ran);
    summary.intake = pump.counts();
    summary.followed = follower.status();
    if (keeper.has_value()) {
      keeper->Finish();
      summary.kept = keeper->counts();
    }
  }
  if (spool != nullptr) summary.spool = spool->status();
  return summary;
}

}  // namespace strata::ros2
