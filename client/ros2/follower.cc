#include "client/ros2/follower.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "client/formats/bags/cloud_poses.h"
#include "client/ros2/messages.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::ros2 {
namespace {

// Its pose may come after a cloud.
constexpr absl::Duration kPoseMayCome = absl::Seconds(1);
constexpr absl::Duration kPosePause = absl::Milliseconds(10);
constexpr absl::Duration kLeastPause = absl::Milliseconds(100);
constexpr absl::Duration kMostPause = absl::Seconds(1);
constexpr double kMovedM = 0.1;
constexpr double kMovedRad = 0.05;
constexpr std::size_t kMostPoints = 40'000;
// Answers without a place until the next is asked for elsewhere: as often as the server looks in a
// row (core/tracking).
constexpr int kMostMisses = 5;

}  // namespace

bool IsStepDue(const Pose& moved, absl::Duration since, bool lost) {
  if (since >= kMostPause) return true;
  if (lost || since < kLeastPause) return false;
  return moved.translation().norm() >= kMovedM || RotationAngleRad(moved) >= kMovedRad;
}

PointCloud CloudForStep(PointCloud cloud) {
  const std::size_t finite = CountFinite(cloud);
  PointCloud step;
  step.sensor_origin = cloud.sensor_origin;
  step.points.reserve(std::min(finite, kMostPoints));
  std::size_t seen = 0;
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!p.allFinite()) continue;
    // The k-th of n goes where k · most / n is a new whole number.
    const std::size_t most = std::min(finite, kMostPoints);
    if (seen * most / finite != (seen + 1) * most / finite) step.points.push_back(p);
    ++seen;
  }
  return step;
}

Follower::Follower(const Options& options,
                   PoseBook& book,
                   const ServerLink& link,
                   Where& where,
                   const Entity& pose_writer,
                   Talk& talk)
    : options_(options),
      book_(book),
      link_(link),
      where_(where),
      pose_writer_(pose_writer),
      talk_(talk),
      guess_(options.guess),
      thread_([this] { Loop(); }) {}

Follower::~Follower() {
  {
    absl::MutexLock lock(&mutex_);
    ending_ = true;
  }
  thread_.join();
}

void Follower::Put(CdrMessage cloud) {
  absl::MutexLock lock(&mutex_);
  cloud_ = std::move(cloud);
}

void Follower::Guess(const Pose& T_map_base) {
  const std::optional<BasePose> base = book_.newest();
  if (!base.has_value()) return;
  absl::MutexLock lock(&mutex_);
  told_ = Normalized(T_map_base * base->T_fixed_base.inverse());
}

FollowerStatus Follower::status() const {
  absl::MutexLock lock(&mutex_);
  return status_;
}

bool Follower::AwaitEnd(absl::Duration longest) {
  absl::MutexLock lock(&mutex_);
  return mutex_.AwaitWithTimeout(absl::Condition(&ending_), longest);
}

std::optional<CdrMessage> Follower::Next() {
  if (AwaitEnd(asked_ + kLeastPause - SteadyNow())) return std::nullopt;
  absl::MutexLock lock(&mutex_);
  const auto due = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return ending_ || cloud_.has_value();
  };
  mutex_.Await(absl::Condition(&due));
  if (ending_) return std::nullopt;
  return std::exchange(cloud_, std::nullopt);
}

void Follower::Loop() {
  while (wanted()) {
    const std::optional<CdrMessage> message = Next();
    if (!message.has_value()) break;
    const absl::Status followed = Follow(*message);
    if (followed.ok()) continue;
    Count(followed);
    if (AwaitEnd(kRetryAfter)) break;
  }
  tracking_.reset();
}

absl::StatusOr<Keyframe> Follower::Placed(const CdrMessage& message) {
  Keyframe keyframe;
  keyframe.message = message;
  STRATA_ASSIGN_OR_RETURN(keyframe.head, ReadRosCloudHead(message.bytes, MessageEncoding::kCdr));
  const RosHeader& header = keyframe.head.header;
  const absl::Time until = SteadyNow() + kPoseMayCome;
  absl::StatusOr<CloudPose> pose = book_.At(header.frame, header.stamp_ns);
  while (!pose.ok() && SteadyNow() < until && !AwaitEnd(kPosePause)) {
    pose = book_.At(header.frame, header.stamp_ns);
  }
  STRATA_RETURN_IF_ERROR(pose.status());
  keyframe.pose = *std::move(pose);
  return keyframe;
}

absl::StatusOr<Follower::Asked> Follower::Ask(const Keyframe& keyframe) {
  KeeperCounts none;
  STRATA_ASSIGN_OR_RETURN(KeptScan scan, ScanOfKeyframe(keyframe, options_.scans, book_, none));
  Asked asked;
  asked.stamp_ns = keyframe.head.header.stamp_ns;
  asked.T_fixed_scan = Normalized(book_.start().inverse() * scan.header.T_map_scan);
  asked.cloud = CloudForStep(std::move(scan.cloud));
  return asked;
}

absl::Status Follower::Follow(const CdrMessage& message) {
  STRATA_ASSIGN_OR_RETURN(const Keyframe keyframe, Placed(message));
  const Pose T_fixed_scan = book_.start().inverse() * keyframe.pose.T_map_scan;
  const absl::Time now = SteadyNow();
  if (T_fixed_last_.has_value() &&
      !IsStepDue(T_fixed_last_->inverse() * T_fixed_scan, now - asked_, lost_)) {
    return absl::OkStatus();
  }
  T_fixed_last_ = T_fixed_scan;
  asked_ = now;
  STRATA_ASSIGN_OR_RETURN(const Asked asked, Ask(keyframe));
  STRATA_RETURN_IF_ERROR(Open(asked.T_fixed_scan));
  TrackStep step;
  step.cloud = asked.cloud;
  step.T_odom_scan = asked.T_fixed_scan;
  const absl::StatusOr<TrackedPose> pose = tracking_->Step(step);
  if (!pose.ok()) tracking_.reset();
  STRATA_RETURN_IF_ERROR(pose.status());
  Take(asked, *pose);
  return absl::OkStatus();
}

std::optional<Pose> Follower::PlaceToLook() const {
  if (!near_) return std::nullopt;
  if (guess_.has_value() || !book_.located()) return guess_;
  return where_.T_map_fixed();
}

absl::Status Follower::Open(const Pose& T_fixed_scan) {
  std::optional<Pose> told;
  {
    absl::MutexLock lock(&mutex_);
    told = std::exchange(told_, std::nullopt);
  }
  if (told.has_value()) {
    tracking_.reset();
    guess_ = told;
    near_ = true;
    misses_ = 0;
  }
  if (tracking_ != nullptr) return absl::OkStatus();
  api::Database* const database = link_.database();
  if (database == nullptr) return absl::UnavailableError("no stratad has answered yet");
  TrackStart start;
  const std::optional<Pose> T_map_fixed = PlaceToLook();
  if (T_map_fixed.has_value()) start.T_map_scan_guess = Normalized(*T_map_fixed * T_fixed_scan);
  STRATA_ASSIGN_OR_RETURN(tracking_,
                          database->posegraph().Track(link_.call(), options_.scans.map, start));
  return absl::OkStatus();
}

void Follower::Take(const Asked& asked, const TrackedPose& pose) {
  Count(pose);
  lost_ = pose.state == TrackState::kLost;
  if (lost_) {
    Miss(pose);
    return;
  }
  misses_ = 0;
  near_ = true;
  guess_.reset();
  const Pose T_map_fixed = Normalized(pose.T_map_scan * asked.T_fixed_scan.inverse());
  if (!book_.located()) Locate(T_map_fixed);
  if (!options_.goes_on) return;
  where_.SetTracked({asked.stamp_ns, T_map_fixed});
  // One that is predicted only may be of a robot that was carried off.
  if (pose.state == TrackState::kTracked) Publish(asked, pose);
}

void Follower::Locate(const Pose& T_map_fixed) {
  book_.SetStart(T_map_fixed);
  const Eigen::Vector3d p = T_map_fixed.translation();
  talk_.Say(absl::StrFormat(
      "found in the map: the odometry begins at %.2f, %.2f, %.2f", p.x(), p.y(), p.z()));
}

// Once it has seen the robot the server looks for it anywhere by itself, before only where it is
// told.
void Follower::Miss(const TrackedPose& pose) {
  if (pose.known || ++misses_ < kMostMisses) return;
  misses_ = 0;
  near_ = !near_;
  tracking_.reset();
}

void Follower::Publish(const Asked& asked, const TrackedPose& pose) {
  const absl::StatusOr<Pose> T_fixed_base = book_.Base(asked.stamp_ns);
  if (!T_fixed_base.ok()) return;
  const Pose T_base_scan = T_fixed_base->inverse() * asked.T_fixed_scan;
  const absl::Status written =
      WritePose(pose_writer_,
                {where_.map_frame(), asked.stamp_ns},
                Normalized(pose.T_map_scan * T_base_scan.inverse()),
                RosCovariance(pose.T_map_scan, pose.covariance, T_base_scan));
  if (!written.ok()) talk_.SaySeldom("pose", std::string(written.message()));
}

void Follower::Count(const absl::StatusOr<TrackedPose>& pose) {
  absl::MutexLock lock(&mutex_);
  status_.trouble = pose.status();
  if (!pose.ok()) return;
  status_.last = *pose;
  status_.when = SteadyNow();
  ++(pose->state == TrackState::kTracked     ? status_.tracked
     : pose->state == TrackState::kPredicted ? status_.predicted
                                             : status_.lost);
}

}  // namespace strata::ros2
