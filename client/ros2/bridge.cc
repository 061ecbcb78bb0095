#include "client/ros2/bridge.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/formats/bags/keyframes.h"
#include "client/formats/bags/ros_messages.h"
#include "client/ros2/goal_planner.h"
#include "client/ros2/listener.h"
#include "client/ros2/localizer.h"
#include "client/ros2/messages.h"
#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/server_link.h"
#include "client/ros2/where.h"
#include "client/ros2/world_publisher.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::ros2 {
namespace {

constexpr char kTransformsType[] = "tf2_msgs/TFMessage";
constexpr char kGoalType[] = "geometry_msgs/PoseStamped";
constexpr absl::Duration kTransformEvery = absl::Milliseconds(50);
// Ahead of the robot's clock, so that it can look up its newest pose before the next one comes.
constexpr std::int64_t kAheadNs = 200'000'000;
constexpr absl::Duration kReportEvery = absl::Seconds(1);
constexpr absl::Duration kBeforeSaying = absl::Seconds(5);  // before what is missing is said
constexpr std::size_t kMostAtOnce = 200;
// Of clouds, between two looks at them: a second of a LiDAR, where the machine has other things to
// do.
constexpr int kCloudDepth = 24;
constexpr int kPoseDepth = 500;

struct Writers {
  Entity map, plan, surfaces, transforms;
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
  if (!options.no_tf) {
    STRATA_ASSIGN_OR_RETURN(writers.transforms,
                            node.MakeWriter("/tf", kTransformsType, {.depth = 100}));
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
  return book;
}

// Reads what the robot publishes, on the thread that runs it.
class Pump {
 public:
  Pump(const Options& options,
       Node& node,
       const Writers& writers,
       PoseBook& book,
       Keeper& keeper,
       GoalPlanner& planner,
       const Where& where,
       Localizer* localizer,
       Talk& talk)
      : options_(options),
        node_(node),
        writers_(writers),
        book_(book),
        keeper_(keeper),
        planner_(planner),
        where_(where),
        localizer_(localizer),
        talk_(talk),
        clouds_(options.clouds, {kPointCloudType}, kCloudDepth),
        poses_(options.poses_from,
               {"nav_msgs/Odometry",
                "geometry_msgs/PoseStamped",
                "geometry_msgs/PoseWithCovarianceStamped"},
               kPoseDepth),
        goals_(options.goals, {kGoalType}, 1),
        intake_(book, *ParseKeyframeSpacing(options.every)) {}

  absl::Status Begin() {
    STRATA_ASSIGN_OR_RETURN(transforms_,
                            node_.MakeReader("/tf", kTransformsType, {.depth = kPoseDepth}));
    STRATA_ASSIGN_OR_RETURN(
        static_transforms_,
        node_.MakeReader(
            "/tf_static", kTransformsType, {.transient_local = true, .depth = kPoseDepth}));
    return absl::OkStatus();
  }

  absl::Status Run(const Stop& stop, const Spool& spool) {
    const absl::Time begun = SteadyNow();
    absl::Time next_transform = begun, next_report = begun;
    while (!stop.requested()) {
      node_.Wait(kTransformEvery);
      if (node_.UpdateOffers()) STRATA_RETURN_IF_ERROR(Follow());
      Read();
      const absl::Time now = SteadyNow();
      for (Keyframe& keyframe : intake_.Decide(now, keeper_.room())) {
        keeper_.Put(std::move(keyframe));
      }
      if (now >= next_transform) {
        next_transform = now + kTransformEvery;
        SayWhere();
      }
      if (now >= next_report) {
        next_report = now + kReportEvery;
        Report(spool.status(), now - begun > kBeforeSaying);
      }
    }
    return absl::OkStatus();
  }

  const IntakeCounts& counts() const { return intake_.counts(); }

 private:
  bool by_transforms() const { return absl::StartsWith(options_.poses_from, "tf:"); }

  absl::Status Follow() {
    const std::vector<Offer> offers = node_.offers();
    STRATA_RETURN_IF_ERROR(clouds_.Follow(node_, offers));
    STRATA_RETURN_IF_ERROR(goals_.Follow(node_, offers));
    return by_transforms() ? absl::OkStatus() : poses_.Follow(node_, offers);
  }

  // Poses before the clouds that need them.
  void Read() {
    ReadTransforms(static_transforms_, "/tf_static", true);
    ReadTransforms(transforms_, "/tf", false);
    for (const CdrMessage& message : poses_.Take(kMostAtOnce)) {
      const auto poses = ReadRosPoses(poses_.topic(), message.bytes);
      Tell("poses",
           options_.poses_from,
           poses.ok() ? book_.AddPose(poses->front()) : poses.status());
    }
    for (CdrMessage& message : clouds_.Take(kCloudDepth)) {
      if (localizer_ != nullptr && !localizer_->done()) {
        localizer_->Put(std::move(message));
      } else {
        intake_.Add(std::move(message), SteadyNow());
      }
    }
    for (const CdrMessage& message : goals_.Take(1)) {
      const auto goal = ReadRosPoses(goals_.topic(), message.bytes);
      Tell("goals", options_.goals, goal.status());
      if (goal.ok()) planner_.Put(goal->front());
    }
  }

  void ReadTransforms(const Entity& reader, const std::string& topic, bool fixed) {
    for (const CdrMessage& message : Node::Take(reader, kMostAtOnce)) {
      const auto transforms =
          ReadRosPoses({topic, kTransformsType, MessageEncoding::kCdr}, message.bytes);
      if (transforms.ok()) WarnOfRival(*transforms);
      Tell(topic,
           topic,
           transforms.ok() ? book_.AddTransforms(*transforms, fixed) : transforms.status());
    }
  }

  // Two that say where the odometry is make a robot jump.
  void WarnOfRival(const std::vector<RosPose>& transforms) {
    if (options_.no_tf) return;
    const std::string fixed = book_.frames().fixed;
    for (const RosPose& transform : transforms) {
      if (transform.child_frame != fixed || fixed.empty()) continue;
      talk_.SayNew("rival",
                   absl::StrCat("somebody else says on /tf where ",
                                fixed,
                                " is, too: end that, or start this with --no-tf"));
    }
  }

  void Tell(const std::string& about, const std::string& topic, const absl::Status& status) {
    if (!status.ok()) talk_.SayNew(about, absl::StrCat(topic, ": ", status.message()));
  }

  // T_map_odom on /tf.
  void SayWhere() {
    const std::string fixed = book_.frames().fixed;
    if (options_.no_tf || fixed.empty() || fixed == options_.map_frame) return;
    const std::int64_t stamp_ns = where_.stamp_ns();
    if (stamp_ns <= 0) return;
    Tell("/tf out",
         "/tf",
         WriteTransform(writers_.transforms,
                        {options_.map_frame, stamp_ns + kAheadNs},
                        fixed,
                        where_.T_map_fixed()));
  }

  void Report(const SpoolStatus& spool, bool patient) {
    if (patient) {
      const std::vector<Offer> offers = node_.offers();
      talk_.SayNew("no clouds", clouds_.heard() ? "" : clouds_.Missing(offers, "--topic"));
      const bool poses = by_transforms() || poses_.heard();
      talk_.SayNew("no poses", poses ? "" : poses_.Missing(offers, "--poses-from"));
    }
    if (clouds_.heard()) {
      talk_.SayNew(
          "clouds",
          absl::StrCat(options_.clouds,
                       clouds_.reliable() ? ": reliable" : ": best effort, some may be lost"));
    }
    talk_.SayNew("sending",
                 !spool.last_error.empty()
                     ? absl::StrCat("scans wait in ", options_.spool, ": ", spool.last_error)
                 : spool.sent > 0 ? "scans are sent"
                                  : "");
    talk_.SayNew("left out",
                 intake_.counts().why.empty()
                     ? ""
                     : absl::StrCat("clouds are left out: ", intake_.counts().why));
    talk_.SayNew(
        "postponed",
        intake_.counts().postponed == 0
            ? ""
            : absl::StrCat("the disk of ",
                           options_.spool,
                           " is slower than keyframes come: where it is busy, later clouds "
                           "are kept"));
    talk_.SayNew("refused",
                 spool.refused + spool.damaged == 0
                     ? ""
                     : absl::StrCat(spool.refused + spool.damaged,
                                    " scans were set aside; ",
                                    options_.spool,
                                    "/refused and damaged have them with the reasons"));
  }

  const Options& options_;
  Node& node_;
  const Writers& writers_;
  PoseBook& book_;
  Keeper& keeper_;
  GoalPlanner& planner_;
  const Where& where_;
  Localizer* const localizer_;  // or null
  Talk& talk_;
  Listener clouds_, poses_, goals_;
  Entity transforms_, static_transforms_;
  Intake intake_;
};

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
  talk.SayNew("server", NobodyAnswers(options.server.server));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Summary> RunBridge(const Options& options, const Stop& stop, Talk& talk) {
  Summary summary;
  summary.trajectory = options.trajectory.empty() ? TrajectoryAt(absl::Now()) : options.trajectory;
  STRATA_ASSIGN_OR_RETURN(const ClientOptions client, cli::ClientOptionsOf(options.server));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Spool> spool, Spool::Open(options.spool));
  STRATA_RETURN_IF_ERROR(CheckMap(options, client, talk));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Node> node, Node::Create(options.domain));
  STRATA_ASSIGN_OR_RETURN(const Writers writers, MakeWriters(*node, options));
  PoseBook book(BookOptions(options));
  const ServerLink link({options.server, client, options.map, summary.trajectory}, *spool, talk);
  const Where where(book, link, options.map_frame);
  {
    Keeper keeper({options.map,
                   summary.trajectory,
                   options.align == "on" ? Alignment::kOn : Alignment::kOff,
                   options.deskew == "on"},
                  book,
                  *spool,
                  talk);
    GoalPlanner planner({options.map, options.profile}, link, where, writers.plan, talk);
    const WorldPublisher world(
        {options.map, options.profile}, link, where, writers.map, writers.surfaces, talk);
    std::optional<Localizer> localizer;
    if (options.localize) localizer.emplace(options.map, options.start, book, link, talk);
    Pump pump(options,
              *node,
              writers,
              book,
              keeper,
              planner,
              where,
              localizer.has_value() ? &*localizer : nullptr,
              talk);
    STRATA_RETURN_IF_ERROR(pump.Begin());
    talk.Say(absl::StrCat("listening in domain ",
                          options.domain,
                          "; trajectory ",
                          summary.trajectory,
                          " of map ",
                          options.map));
    const absl::Status ran = pump.Run(stop, *spool);
    link.EndCalls();  // or a long search would be waited for
    STRATA_RETURN_IF_ERROR(ran);
    summary.intake = pump.counts();
    keeper.Finish();
    summary.kept = keeper.counts();
  }
  summary.spool = spool->status();
  return summary;
}

}  // namespace strata::ros2
