// The messages of ROS 1 and ROS 2 that a map is made from.
#ifndef STRATA_CLIENT_FORMATS_BAGS_ROS_MESSAGES_H_
#define STRATA_CLIENT_FORMATS_BAGS_ROS_MESSAGES_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/ros_topic.h"
#include "core/cloud/point_cloud.h"

namespace strata {

inline constexpr char kPointCloudType[] = "sensor_msgs/PointCloud2";
inline constexpr char kLaserScanType[] = "sensor_msgs/LaserScan";
inline constexpr char kJointStateType[] = "sensor_msgs/JointState";

// std_msgs/Header. Frames come without the slash that early ROS puts before them.
struct RosHeader {
  std::int64_t stamp_ns = 0;  // since 1970, or since a simulation began
  std::string frame;
};

// A quaternion has x, y, z, w.
struct RosPose {
  RosHeader header;         // the frame it is in
  std::string child_frame;  // whose pose it is; empty where the message does not say
  std::array<double, 3> position_m{};
  std::array<double, 4> quaternion{};
};

// What can be said of a cloud without its points.
struct RosCloudHead {
  RosHeader header;
  std::uint64_t points = 0;
  bool has_point_times = false;  // a field t, time, timestamp, …
};

// A line of a laser whose mirror turns about z of its frame.
struct RosLaserScan {
  RosHeader header;
  // d (cos α, sin α, 0), thesis 4.4, with the seconds after the stamp as times, unless they are all
  // 0, and intensities where there is one for each; returns out of the laser's own bounds are left
  // out.
  PointCloud line;
};

struct RosJointState {
  RosHeader header;
  std::vector<std::string> names;
  std::vector<double> positions;  // [rad or m], beside the names; empty where only speeds are told
};

// Whether ReadRosPoses reads them, from "nav_msgs/Odometry", "geometry_msgs/PoseStamped",
// "geometry_msgs/PoseWithCovarianceStamped".
bool IsPoseType(absl::string_view type);
bool IsTransformsType(absl::string_view type);  // "tf2_msgs/TFMessage", "tf/tfMessage"

// All: the bytes of a message of a topic of that type; INVALID_ARGUMENT if they are cut short, or
// not as the topic's encoding has it. CDR may have either order of bytes, and XCDR 2's alignment.

absl::StatusOr<RosCloudHead> ReadRosCloudHead(absl::string_view bytes, MessageEncoding encoding);

// The cloud as ReadPcd would make it of the same fields (names as MeaningOf; rows make it
// organised); fields of more than one number are left out.
absl::StatusOr<PointCloud> ReadRosCloud(absl::string_view bytes, MessageEncoding encoding);

// INVALID_ARGUMENT, too, for angles that are none and lines of more than 30 s.
absl::StatusOr<RosLaserScan> ReadRosLaserScan(absl::string_view bytes, MessageEncoding encoding);
// INVALID_ARGUMENT, too, if there are positions and not one for each name.
absl::StatusOr<RosJointState> ReadRosJointState(absl::string_view bytes, MessageEncoding encoding);

// One of a type that IsPoseType, any number of one that IsTransformsType.
absl::StatusOr<std::vector<RosPose>> ReadRosPoses(const BagTopic& topic, absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_ROS_MESSAGES_H_
