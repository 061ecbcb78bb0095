// Where the robot is in the map: its odometry, corrected by where it was seen in the map last.
#ifndef STRATA_CLIENT_ROS2_WHERE_H_
#define STRATA_CLIENT_ROS2_WHERE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "client/ros2/pose_book.h"
#include "client/ros2/server_link.h"
#include "core/geometry/pose.h"

namespace strata::ros2 {

// By a scan that was tracked.
struct TrackedFix {
  std::int64_t stamp_ns = 0;
  Pose T_map_fixed = Pose::Identity();
};

// The newest counts of the last scan that was tracked and the last of the robot's scans that is in
// the map: whoever maps goes on by what it maps where it is not tracked, and who does neither stays
// as it was. Thread-safe; what it looks at outlives it.
class Where {
 public:
  Where(PoseBook& book, const ServerLink& link, std::string map_frame)
      : book_(book), link_(link), map_frame_(std::move(map_frame)) {}

  void SetTracked(const TrackedFix& fix);

  const std::string& map_frame() const { return map_frame_; }
  // T_map_odom: of the frame that the odometry calls fixed.
  Pose T_map_fixed() const;
  // Whether it is known where the odometry is in the map.
  bool known() const { return book_.located() && book_.newest().has_value(); }
  // T_map_base at the newest stamp; nullopt while it is not known.
  std::optional<Pose> T_map_base() const;
  std::int64_t stamp_ns() const;  // of the newest pose, by the robot's clock; 0 before the first
  // T_map_frame now. NOT_FOUND.
  absl::StatusOr<Pose> InMap(const std::string& frame) const;

 private:
  PoseBook& book_;
  const ServerLink& link_;
  const std::string map_frame_;
  mutable absl::Mutex mutex_;
  std::optional<TrackedFix> tracked_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_WHERE_H_
