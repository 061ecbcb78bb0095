// Names as ROS 2 writes them on the wire, so that nodes of ROS 2 and strata-ros2 hear one another.
#ifndef STRATA_CLIENT_ROS2_ROS_TYPES_H_
#define STRATA_CLIENT_ROS2_ROS_TYPES_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <dds/dds.h>

namespace strata::ros2 {

// "/ouster/points" is "rt/ouster/points" in DDS.
std::string DdsTopicName(absl::string_view topic);
// The other way round; empty for what is no topic of ROS 2.
std::string RosTopicName(absl::string_view dds_topic);
// "sensor_msgs/PointCloud2" is "sensor_msgs::msg::dds_::PointCloud2_" in DDS.
std::string DdsTypeName(absl::string_view type);
// The other way round; empty for what is no message of ROS 2.
std::string RosTypeName(absl::string_view dds_type);

// INVALID_ARGUMENT unless it is a whole name: a slash before each word of letters, digits and '_'
// that begins with no digit, at most 255 characters.
absl::Status ValidateTopicName(absl::string_view topic);

// Of a type that ros_messages.idl has; null for others.
const dds_topic_descriptor_t* DescriptorOf(absl::string_view type);

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_ROS_TYPES_H_
