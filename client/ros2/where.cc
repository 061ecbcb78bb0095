#include "client/ros2/where.h"

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"

namespace strata::ros2 {

void Where::SetTracked(const TrackedFix& fix) {
  absl::MutexLock lock(&mutex_);
  tracked_ = fix;
}

Pose Where::T_map_fixed() const {
  const Correction mapped = link_.correction();
  {
    absl::MutexLock lock(&mutex_);
    if (tracked_.has_value() && tracked_->stamp_ns >= mapped.stamp_ns) return tracked_->T_map_fixed;
  }
  return Normalized(mapped.T_now_uploaded * book_.start());
}

std::optional<Pose> Where::T_map_base() const {
  const std::optional<BasePose> base = book_.newest();
  if (!base.has_value() || !book_.located()) return std::nullopt;
  return T_map_fixed() * base->T_fixed_base;
}

std::int64_t Where::stamp_ns() const {
  const std::optional<BasePose> base = book_.newest();
  return base.has_value() ? base->stamp_ns : 0;
}

absl::StatusOr<Pose> Where::InMap(const std::string& frame) const {
  if (frame.empty() || frame == map_frame_) return Pose::Identity();
  if (!book_.located())
    return absl::NotFoundError("where the robot is in the map is not known yet");
  STRATA_ASSIGN_OR_RETURN(const Pose T_fixed_frame, book_.InFixed(frame));
  return T_map_fixed() * T_fixed_frame;
}

}  // namespace strata::ros2
