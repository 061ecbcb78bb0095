#include "client/ros2/pump.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "client/formats/bags/keyframes.h"
#include "client/formats/bags/pose_track.h"
#include "client/formats/bags/ros_messages.h"
#include "client/ros2/diagnosis.h"
#include "client/ros2/messages.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::ros2 {
namespace {

constexpr char kTransformsType[] = "tf2_msgs/TFMessage";
constexpr absl::Duration kTransformEvery = absl::Milliseconds(50);
// Ahead of the robot's clock, so that it can look up its newest pose before the next one comes.
constexpr std::int64_t kAheadNs = 200'000'000;
constexpr absl::Duration kReportEvery = absl::Seconds(1);
constexpr absl::Duration kBeforeSaying = absl::Seconds(5);  // what is missing
constexpr std::size_t kMostAtOnce = 200;
// Of clouds, between two looks at them: a second of a LiDAR, where the machine has other things to
// do.
constexpr int kCloudDepth = 24;
constexpr int kPoseDepth = 500;

}  // namespace

Pump::Pump(const Options& options, const Parts& parts)
    : options_(options),
      parts_(parts),
      clouds_(options.clouds, {kPointCloudType}, kCloudDepth),
      poses_(options.poses_from,
             {"nav_msgs/Odometry",
              "geometry_msgs/PoseStamped",
              "geometry_msgs/PoseWithCovarianceStamped"},
             kPoseDepth),
      goals_(options.goals, {"geometry_msgs/PoseStamped"}, 1),
      guesses_(options.initial_pose, {"geometry_msgs/PoseWithCovarianceStamped"}, 1),
      intake_(parts.book, *ParseKeyframeSpacing(options.every)) {}

absl::Status Pump::Begin() {
  STRATA_ASSIGN_OR_RETURN(transforms_,
                          parts_.node.MakeReader("/tf", kTransformsType, {.depth = kPoseDepth}));
  STRATA_ASSIGN_OR_RETURN(
      static_transforms_,
      parts_.node.MakeReader(
          "/tf_static", kTransformsType, {.transient_local = true, .depth = kPoseDepth}));
  return absl::OkStatus();
}

absl::Status Pump::Run(const Stop& stop) {
  const absl::Time begun = SteadyNow();
  tracked_ = begun;
  absl::Time next_transform = begun, next_report = begun;
  while (!stop.requested()) {
    parts_.node.Wait(kTransformEvery);
    if (parts_.node.UpdateOffers()) STRATA_RETURN_IF_ERROR(Follow());
    Read();
    const absl::Time now = SteadyNow();
    Keep(now);
    if (now >= next_transform) {
      next_transform = now + kTransformEvery;
      SayWhere();
    }
    if (now < next_report) continue;
    next_report = now + kReportEvery;
    if (now - begun > kBeforeSaying) ReportMissing();
    ReportClouds();
    if (parts_.spool != nullptr) ReportSpool(parts_.spool->status());
    Diagnose(now);
  }
  return absl::OkStatus();
}

void Pump::Keep(absl::Time now) {
  if (parts_.keeper == nullptr) return;
  for (Keyframe& keyframe : intake_.Decide(now, parts_.keeper->room())) {
    parts_.keeper->Put(std::move(keyframe));
  }
}

bool Pump::by_transforms() const { return absl::StartsWith(options_.poses_from, "tf:"); }

absl::Status Pump::Follow() {
  const std::vector<Offer> offers = parts_.node.offers();
  STRATA_RETURN_IF_ERROR(clouds_.Follow(parts_.node, offers));
  STRATA_RETURN_IF_ERROR(goals_.Follow(parts_.node, offers));
  STRATA_RETURN_IF_ERROR(guesses_.Follow(parts_.node, offers));
  return by_transforms() ? absl::OkStatus() : poses_.Follow(parts_.node, offers);
}

// Poses before the clouds that need them.
void Pump::Read() {
  ReadTransforms(static_transforms_, "/tf_static", true);
  ReadTransforms(transforms_, "/tf", false);
  ReadPoses();
  ReadClouds();
  ReadGoals();
  ReadGuesses();
}

void Pump::ReadTransforms(const Entity& reader, const std::string& topic, bool fixed) {
  for (const CdrMessage& message : Node::Take(reader, kMostAtOnce)) {
    const auto transforms =
        ReadRosPoses({topic, kTransformsType, MessageEncoding::kCdr}, message.bytes);
    if (transforms.ok()) WarnOfRival(*transforms);
    Tell(topic,
         transforms.ok() ? parts_.book.AddTransforms(*transforms, fixed) : transforms.status());
  }
}

void Pump::ReadPoses() {
  for (const CdrMessage& message : poses_.Take(kMostAtOnce)) {
    const auto poses = ReadRosPoses(poses_.topic(), message.bytes);
    Tell(options_.poses_from, poses.ok() ? parts_.book.AddPose(poses->front()) : poses.status());
  }
}

// Nothing is kept before it is known where the robot is.
void Pump::ReadClouds() {
  for (CdrMessage& message : clouds_.Take(kCloudDepth)) {
    if (parts_.follower.wanted()) parts_.follower.Put(message);
    if (parts_.keeper != nullptr && parts_.book.located()) {
      intake_.Add(std::move(message), SteadyNow());
    }
  }
}

void Pump::ReadGoals() {
  for (const CdrMessage& message : goals_.Take(1)) {
    const auto goal = ReadRosPoses(goals_.topic(), message.bytes);
    Tell(options_.goals, goal.status());
    if (goal.ok()) parts_.planner.Put(goal->front());
  }
}

absl::StatusOr<Pose> Pump::PoseInMap(const RosPose& pose) const {
  PoseTrack one;
  STRATA_RETURN_IF_ERROR(one.Add(pose.header.stamp_ns, pose.position_m, pose.quaternion));
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_frame, parts_.where.InMap(pose.header.frame));
  Pose T_map_base = Normalized(T_map_frame * one.Last());
  // RViz points at the plane of height 0, whatever storey it shows.
  const std::optional<Pose> now = parts_.where.T_map_base();
  if (now.has_value() && T_map_base.translation().z() == 0.0) {
    T_map_base.translation().z() = now->translation().z();
  }
  return T_map_base;
}

void Pump::ReadGuesses() {
  for (const CdrMessage& message : guesses_.Take(1)) {
    const auto poses = ReadRosPoses(guesses_.topic(), message.bytes);
    const absl::StatusOr<Pose> T_map_base =
        poses.ok() ? PoseInMap(poses->front()) : absl::StatusOr<Pose>(poses.status());
    Tell(options_.initial_pose, T_map_base.status());
    if (T_map_base.ok()) parts_.follower.Guess(*T_map_base);
  }
}

// Two that say where the odometry is make a robot jump.
void Pump::WarnOfRival(const std::vector<RosPose>& transforms) {
  const std::string fixed = parts_.book.frames().fixed;
  if (options_.no_tf || fixed.empty()) return;
  for (const RosPose& transform : transforms) {
    if (transform.child_frame != fixed) continue;
    parts_.talk.SayNew("rival",
                       absl::StrCat("somebody else says on /tf where ",
                                    fixed,
                                    " is, too: end that, or start this with --no-tf"));
  }
}

// T_map_odom on /tf.
void Pump::SayWhere() {
  const std::string fixed = parts_.book.frames().fixed;
  const std::int64_t stamp_ns = parts_.where.stamp_ns();
  if (!parts_.transform_writer || !parts_.where.known() || stamp_ns <= 0) return;
  if (fixed.empty() || fixed == options_.map_frame) return;
  Tell("/tf out",
       WriteTransform(parts_.transform_writer,
                      {options_.map_frame, stamp_ns + kAheadNs},
                      fixed,
                      parts_.where.T_map_fixed()));
}

void Pump::Diagnose(absl::Time now) {
  if (!parts_.follower.wanted()) return;
  const FollowerStatus status = parts_.follower.status();
  const Diagnosis diagnosis =
      DiagnosisOf(status, parts_.keeper != nullptr, parts_.book.located(), now);
  Tell("/diagnostics",
       WriteDiagnosis(parts_.diagnosis_writer, {"", parts_.where.stamp_ns()}, diagnosis));
  const bool tracked = diagnosis.level == Diagnosis::Level::kOk;
  if (tracked) tracked_ = now;
  // Others say that no server answers.
  if (now - tracked_ > kBeforeSaying && !absl::IsUnavailable(status.trouble)) {
    // Whoever maps need not know why each second.
    if (diagnosis.level == Diagnosis::Level::kWarn) {
      parts_.talk.SayNew("tracked", "map -> odom is by the robot's own scans");
    } else if (!tracked) {
      parts_.talk.SayNew("tracked", "");
      parts_.talk.SaySeldom("place", diagnosis.message);
    }
  }
  if (tracked) parts_.talk.SayNew("tracked", "the robot is tracked in the map");
}

void Pump::ReportMissing() {
  const std::vector<Offer> offers = parts_.node.offers();
  parts_.talk.SayNew("no clouds", clouds_.heard() ? "" : clouds_.Missing(offers, "--topic"));
  const bool poses = by_transforms() || poses_.heard();
  parts_.talk.SayNew("no poses", poses ? "" : poses_.Missing(offers, "--poses-from"));
}

void Pump::ReportClouds() {
  if (clouds_.heard()) {
    parts_.talk.SayNew(
        "clouds",
        absl::StrCat(options_.clouds,
                     clouds_.reliable() ? ": reliable" : ": best effort, some may be lost"));
  }
  const IntakeCounts& counts = intake_.counts();
  if (!counts.why.empty()) {
    parts_.talk.SaySeldom("left out", absl::StrCat("clouds are left out: ", counts.why));
  }
  if (counts.postponed == 0) return;
  parts_.talk.SayNew("postponed",
                     absl::StrCat("the disk of ",
                                  options_.spool,
                                  " is slower than keyframes come: where it is busy, later clouds "
                                  "are kept"));
}

void Pump::ReportSpool(const SpoolStatus& spool) {
  parts_.talk.SayNew("sending",
                     !spool.last_error.empty()
                         ? absl::StrCat("scans wait in ", options_.spool, ": ", spool.last_error)
                     : spool.sent > 0 ? "scans are sent"
                                      : "");
  if (spool.refused + spool.damaged == 0) return;
  parts_.talk.SaySeldom("refused",
                        absl::StrCat(spool.refused + spool.damaged,
                                     " scans were set aside; ",
                                     options_.spool,
                                     "/refused and damaged have them with the reasons"));
}

void Pump::Tell(const std::string& topic, const absl::Status& status) {
  if (!status.ok()) parts_.talk.SaySeldom(topic, absl::StrCat(topic, ": ", status.message()));
}

}  // namespace strata::ros2
