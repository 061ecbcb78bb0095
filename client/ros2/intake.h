// Which of the clouds that come are keyframes: each is looked at as soon as its pose is known.
#ifndef STRATA_CLIENT_ROS2_INTAKE_H_
#define STRATA_CLIENT_ROS2_INTAKE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "client/formats/bags/keyframes.h"
#include "client/formats/bags/ros_messages.h"
#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"

namespace strata::ros2 {

// A cloud that is to be kept, as it came.
struct Keyframe {
  CdrMessage message;
  RosCloudHead head;
  CloudPose pose;
};

// What became of the clouds of the topic.
struct IntakeCounts {
  std::uint64_t clouds = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t unreadable = 0;    // no PointCloud2, or too large
  std::uint64_t without_pose = 0;  // none came within kPatience
  std::uint64_t back_in_time = 0;  // not newer than one before
  std::uint64_t crowded_out = 0;   // too many waited for their poses
  std::uint64_t postponed = 0;     // keyframes that gave way to a later one: the disk was busy
  std::string why;                 // of the last that was left out
};

// Not thread-safe. Holds messages, not points: at most kMostWaitingBytes of them.
class Intake {
 public:
  // How long after a cloud its pose may come.
  static constexpr absl::Duration kPatience = absl::Seconds(1);
  static constexpr std::size_t kMostWaitingBytes = std::size_t{24} << 20;
  // Larger clouds are not taken.
  static constexpr std::size_t kMostCloudBytes = std::size_t{16} << 20;

  Intake(PoseBook& book, const KeyframeSpacing& spacing) : book_(book), chooser_(spacing) {}

  void Add(CdrMessage message, absl::Time now);
  // Those that are due while less than `room_bytes` are; where there is no room, a later cloud
  // becomes the keyframe.
  std::vector<Keyframe> Decide(absl::Time now, std::size_t room_bytes);

  const IntakeCounts& counts() const { return counts_; }

 private:
  struct Waiting {
    CdrMessage message;
    RosCloudHead head;
    absl::Time came;
  };
  void LeaveOut(std::uint64_t IntakeCounts::*count, const absl::Status& why);

  PoseBook& book_;
  KeyframeChooser chooser_;
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::int64_t last_ns_ = std::numeric_limits<std::int64_t>::min();  // decided
  IntakeCounts counts_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_INTAKE_H_
