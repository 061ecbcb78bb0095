#include "client/formats/bags/pose_track.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr std::int64_t kLongestGapNs = 1'000'000'000;
constexpr double kUnitTolerance = 0.01;

Eigen::Quaterniond UnitQuaternion(const std::array<double, 4>& q) {
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
}

}  // namespace

absl::Status PoseTrack::Add(std::int64_t stamp_ns,
                            const std::array<double, 3>& position_m,
                            const std::array<double, 4>& quaternion) {
  const bool finite = std::all_of(
      position_m.begin(), position_m.end(), [](double number) { return std::isfinite(number); });
  const double length = Eigen::Vector4d(quaternion.data()).norm();
  if (!finite || !(std::abs(length - 1.0) <= kUnitTolerance)) {
    return absl::InvalidArgumentError(
        absl::StrCat("a pose is not finite or its quaternion has length ", length));
  }
  sorted_ = sorted_ && (poses_.empty() || stamp_ns >= poses_.back().stamp_ns);
  first_ns_ = poses_.empty() ? stamp_ns : std::min(first_ns_, stamp_ns);
  last_ns_ = poses_.empty() ? stamp_ns : std::max(last_ns_, stamp_ns);
  last_added_ = {stamp_ns, position_m, quaternion};
  poses_.push_back(last_added_);
  return absl::OkStatus();
}

void PoseTrack::Sort() {
  if (sorted_) return;
  std::stable_sort(poses_.begin(), poses_.end(), [](const Stamped& a, const Stamped& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  sorted_ = true;
}

absl::StatusOr<Pose> PoseTrack::At(std::int64_t stamp_ns) {
  Sort();
  const auto after = std::lower_bound(
      poses_.begin(), poses_.end(), stamp_ns, [](const Stamped& pose, std::int64_t stamp) {
        return pose.stamp_ns < stamp;
      });
  if (after != poses_.end() && after->stamp_ns == stamp_ns) {
    return MakePose(UnitQuaternion(after->quaternion), Eigen::Vector3d(after->position_m.data()));
  }
  if (after == poses_.begin() || after == poses_.end()) {
    return absl::NotFoundError(
        absl::StrFormat("time %.3f s is outside of the poses' %.3f to %.3f s",
                        1e-9 * static_cast<double>(stamp_ns),
                        1e-9 * static_cast<double>(first_ns_),
                        1e-9 * static_cast<double>(last_ns_)));
  }
  const Stamped& a = *(after - 1);
  const Stamped& b = *after;
  // The stamps of a damaged bag may be any: their difference as of numbers that do not overflow.
  const double gap_ns = static_cast<double>(b.stamp_ns) - static_cast<double>(a.stamp_ns);
  if (gap_ns > static_cast<double>(kLongestGapNs)) {
    return absl::NotFoundError(absl::StrFormat("time %.3f s is in a gap of %.3f s between poses",
                                               1e-9 * static_cast<double>(stamp_ns),
                                               1e-9 * gap_ns));
  }
  const double share =
      static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
  const Eigen::Vector3d from(a.position_m.data());
  const Eigen::Vector3d to(b.position_m.data());
  return MakePose(
      UnitQuaternion(a.quaternion).slerp(share, UnitQuaternion(b.quaternion)).normalized(),
      from + share * (to - from));
}

void PoseTrack::DropBefore(std::int64_t stamp_ns) {
  Sort();
  auto kept = std::lower_bound(
      poses_.begin(), poses_.end(), stamp_ns, [](const Stamped& pose, std::int64_t stamp) {
        return pose.stamp_ns < stamp;
      });
  if (kept != poses_.begin()) --kept;
  poses_.erase(poses_.begin(), kept);
  if (!poses_.empty()) first_ns_ = poses_.front().stamp_ns;
}

Pose PoseTrack::Last() const {
  return MakePose(UnitQuaternion(last_added_.quaternion),
                  Eigen::Vector3d(last_added_.position_m.data()));
}

}  // namespace strata
