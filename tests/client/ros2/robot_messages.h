// Messages of a robot, and a book that knows its sensor.
#ifndef STRATA_TESTS_CLIENT_ROS2_ROBOT_MESSAGES_H_
#define STRATA_TESTS_CLIENT_ROS2_ROBOT_MESSAGES_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"
#include "core/geometry/pose.h"
#include "tests/support/bag_writer.h"

namespace strata::ros2 {

inline constexpr std::int64_t kSecond = 1'000'000'000;
inline constexpr std::int64_t kBegin = 1'790'000'000 * kSecond;

inline CdrMessage MessageOf(std::string bytes) {
  auto owner = std::make_shared<const std::string>(std::move(bytes));
  const absl::string_view view = *owner;
  return {std::move(owner), view};
}

// A few points around the sensor, `seconds` after the beginning.
inline CdrMessage CloudAt(double seconds, const std::string& frame = "lidar") {
  const std::vector<Eigen::Vector4f> points = {{1, 0, 0, 5}, {0, 2, 0, 6}, {0, 0, 3, 7}};
  return MessageOf(testing::CloudMessage(
      testing::Layout::kCdr, kBegin + static_cast<std::int64_t>(1e9 * seconds), frame, points));
}

inline RosPose PoseAt(double seconds,
                      const std::string& frame,
                      const std::string& child,
                      const Eigen::Vector3d& place) {
  RosPose pose;
  pose.header = {kBegin + static_cast<std::int64_t>(1e9 * seconds), frame};
  pose.child_frame = child;
  pose.position_m = {place.x(), place.y(), place.z()};
  pose.quaternion = {0.0, 0.0, 0.0, 1.0};
  return pose;
}

}  // namespace strata::ros2

#endif  // STRATA_TESTS_CLIENT_ROS2_ROBOT_MESSAGES_H_
