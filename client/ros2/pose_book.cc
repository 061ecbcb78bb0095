#include "client/ros2/pose_book.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata::ros2 {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kKeptNs = 60 * kSecondNs;
constexpr std::int64_t kForgetEveryNs = 5 * kSecondNs;
constexpr std::size_t kMostPoses = 100'000;
// Transforms of one chain come with stamps of their own.
constexpr std::size_t kStampsTried = 8;

absl::Status TooMany() {
  return absl::InvalidArgumentError(
      absl::StrCat("more than ", kMostPoses, " poses or transforms within a minute"));
}

}  // namespace

void PoseBook::SetStart(const Pose& T_map_fixed) {
  absl::MutexLock lock(&mutex_);
  T_map_fixed_ = T_map_fixed;
  located_ = true;
}

bool PoseBook::located() const {
  absl::MutexLock lock(&mutex_);
  return located_;
}

Pose PoseBook::start() const {
  absl::MutexLock lock(&mutex_);
  return T_map_fixed_;
}

absl::Status PoseBook::AddPose(const RosPose& pose) {
  absl::MutexLock lock(&mutex_);
  if (track_.size() >= kMostPoses) return TooMany();
  STRATA_RETURN_IF_ERROR(track_.Add(pose.header.stamp_ns, pose.position_m, pose.quaternion));
  frames_ = {pose.header.frame, pose.child_frame};
  if (!newest_.has_value() || pose.header.stamp_ns > newest_->stamp_ns) {
    newest_ = {pose.header.stamp_ns, track_.Last()};
  }
  Forget();
  return absl::OkStatus();
}

absl::Status PoseBook::AddTransforms(const std::vector<RosPose>& transforms, bool fixed) {
  absl::MutexLock lock(&mutex_);
  absl::Status fault;
  for (const RosPose& transform : transforms) {
    const absl::Status added =
        transforms_.size() >= kMostPoses ? TooMany() : transforms_.Add(transform, fixed);
    if (fault.ok()) fault = added;
    if (!added.ok() || fixed) continue;
    stamps_.push_front(transform.header.stamp_ns);
    if (stamps_.size() > kStampsTried) stamps_.pop_back();
  }
  if (options_.transforms.has_value()) FindNewest();
  Forget();
  return fault;
}

absl::StatusOr<Pose> PoseBook::BaseAt(std::int64_t stamp_ns) {
  if (!options_.transforms.has_value()) return track_.At(stamp_ns);
  return transforms_.Lookup(options_.transforms->fixed, options_.transforms->base, stamp_ns);
}

void PoseBook::FindNewest() {
  frames_ = *options_.transforms;
  for (const std::int64_t stamp_ns : stamps_) {
    if (newest_.has_value() && stamp_ns <= newest_->stamp_ns) continue;
    const absl::StatusOr<Pose> T = BaseAt(stamp_ns);
    if (T.ok()) newest_ = {stamp_ns, *T};
  }
}

void PoseBook::Forget() {
  std::int64_t last_ns = newest_.has_value() ? newest_->stamp_ns : 0;
  if (!stamps_.empty() && !options_.transforms.has_value()) {
    last_ns = newest_.has_value() ? last_ns : stamps_.front();
  }
  if (last_ns < forgotten_ns_ + kForgetEveryNs) return;
  forgotten_ns_ = last_ns;
  track_.DropBefore(last_ns - kKeptNs);
  transforms_.DropBefore(last_ns - kKeptNs);
}

absl::StatusOr<CloudPose> PoseBook::At(const std::string& frame, std::int64_t stamp_ns) {
  absl::MutexLock lock(&mutex_);
  if (!options_.transforms.has_value() && track_.size() == 0) {
    return absl::NotFoundError("no pose has come yet");
  }
  STRATA_ASSIGN_OR_RETURN(const Pose T_fixed_base, BaseAt(stamp_ns));
  STRATA_ASSIGN_OR_RETURN(
      CloudPose pose,
      PoseOfCloud(T_fixed_base, frames_, options_.T_base_cloud, frame, stamp_ns, transforms_));
  // Left alone where it is the identity: the bits of an import of the same poses.
  if (!T_map_fixed_.matrix().isIdentity(0.0)) {
    pose.T_map_scan = Normalized(T_map_fixed_ * pose.T_map_scan);
  }
  return pose;
}

absl::StatusOr<Pose> PoseBook::Base(std::int64_t stamp_ns) {
  absl::MutexLock lock(&mutex_);
  return BaseAt(stamp_ns);
}

absl::StatusOr<Pose> PoseBook::InFixed(const std::string& frame) {
  absl::MutexLock lock(&mutex_);
  if (!newest_.has_value()) return absl::NotFoundError("no pose of the robot has come yet");
  if (frame == frames_.fixed) return Pose::Identity();
  if (frame == frames_.base) return newest_->T_fixed_base;
  STRATA_ASSIGN_OR_RETURN(const Pose T_base_frame,
                          transforms_.Lookup(frames_.base, frame, newest_->stamp_ns));
  return newest_->T_fixed_base * T_base_frame;
}

std::optional<BasePose> PoseBook::newest() const {
  absl::MutexLock lock(&mutex_);
  return newest_;
}

PoseFrames PoseBook::frames() const {
  absl::MutexLock lock(&mutex_);
  return frames_;
}

}  // namespace strata::ros2
