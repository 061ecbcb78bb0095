#include "client/ros2/intake.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

namespace strata::ros2 {

void Intake::LeaveOut(std::uint64_t IntakeCounts::*count, const absl::Status& why) {
  ++(counts_.*count);
  counts_.why = std::string(why.message());
}

void Intake::Add(CdrMessage message, absl::Time now) {
  ++counts_.clouds;
  if (message.bytes.size() > kMostCloudBytes) {
    LeaveOut(&IntakeCounts::unreadable,
             absl::InvalidArgumentError(absl::StrCat(
                 "a cloud of ", message.bytes.size(), " bytes; at most ", kMostCloudBytes)));
    return;
  }
  absl::StatusOr<RosCloudHead> head = ReadRosCloudHead(message.bytes, MessageEncoding::kCdr);
  if (!head.ok() || head->points == 0) {
    LeaveOut(&IntakeCounts::unreadable,
             head.ok() ? absl::InvalidArgumentError("the cloud has no points") : head.status());
    return;
  }
  waiting_bytes_ += message.bytes.size();
  waiting_.push_back({std::move(message), *std::move(head), now});
  while (waiting_bytes_ > kMostWaitingBytes) {
    waiting_bytes_ -= waiting_.front().message.bytes.size();
    waiting_.pop_front();
    LeaveOut(&IntakeCounts::crowded_out,
             absl::ResourceExhaustedError("clouds came faster than their poses"));
  }
}

std::vector<Keyframe> Intake::Decide(absl::Time now, std::size_t room_bytes) {
  std::vector<Keyframe> keyframes;
  std::size_t bytes = 0;
  while (!waiting_.empty()) {
    Waiting& next = waiting_.front();
    const std::int64_t stamp_ns = next.head.header.stamp_ns;
    const absl::StatusOr<CloudPose> pose = book_.At(next.head.header.frame, stamp_ns);
    if (!pose.ok() && now - next.came < kPatience) break;
    if (!pose.ok()) {
      LeaveOut(&IntakeCounts::without_pose, pose.status());
    } else if (stamp_ns <= last_ns_) {
      LeaveOut(&IntakeCounts::back_in_time,
               absl::InvalidArgumentError(absl::StrFormat(
                   "stamp %.6f s is not after that of the cloud before, %.6f s; where the robot's "
                   "clock was set back, start again",
                   1e-9 * static_cast<double>(stamp_ns),
                   1e-9 * static_cast<double>(last_ns_))));
    } else {
      last_ns_ = stamp_ns;
      const double stamp_s = 1e-9 * static_cast<double>(stamp_ns);
      if (bytes >= room_bytes) {
        counts_.postponed += chooser_.WouldKeep(stamp_s, pose->T_map_scan) ? 1 : 0;
      } else if (chooser_.Keep(stamp_s, pose->T_map_scan)) {
        bytes += next.message.bytes.size();
        keyframes.push_back({next.message, next.head, *pose});
        ++counts_.keyframes;
      }
    }
    waiting_bytes_ -= next.message.bytes.size();
    waiting_.pop_front();
  }
  return keyframes;
}

}  // namespace strata::ros2
