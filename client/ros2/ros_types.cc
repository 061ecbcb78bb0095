#include "client/ros2/ros_types.h"

#include <cstddef>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include <ros_messages.h>

namespace strata::ros2 {
namespace {

constexpr absl::string_view kTopicPrefix = "rt";
constexpr absl::string_view kTypeMiddle = "::msg::dds_::";
constexpr std::size_t kLongestName = 255;

struct NamedDescriptor {
  absl::string_view type;
  const dds_topic_descriptor_t* descriptor;
};

constexpr NamedDescriptor kDescriptors[] = {
    {"sensor_msgs/PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc},
    {"tf2_msgs/TFMessage", &tf2_msgs_msg_dds__TFMessage__desc},
    {"nav_msgs/Odometry", &nav_msgs_msg_dds__Odometry__desc},
    {"geometry_msgs/PoseStamped", &geometry_msgs_msg_dds__PoseStamped__desc},
    {"geometry_msgs/PoseWithCovarianceStamped",
     &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc},
    {"nav_msgs/OccupancyGrid", &nav_msgs_msg_dds__OccupancyGrid__desc},
    {"nav_msgs/Path", &nav_msgs_msg_dds__Path__desc},
    {"diagnostic_msgs/DiagnosticArray", &diagnostic_msgs_msg_dds__DiagnosticArray__desc},
};

bool IsWord(absl::string_view word) {
  if (word.empty() || absl::ascii_isdigit(static_cast<unsigned char>(word.front()))) return false;
  for (const char c : word) {
    if (c != '_' && !absl::ascii_isalnum(static_cast<unsigned char>(c))) return false;
  }
  return true;
}

}  // namespace

std::string DdsTopicName(absl::string_view topic) { return absl::StrCat(kTopicPrefix, topic); }

std::string RosTopicName(absl::string_view dds_topic) {
  absl::string_view topic = dds_topic;
  if (!absl::ConsumePrefix(&topic, kTopicPrefix) || topic.empty() || topic.front() != '/') {
    return "";
  }
  return std::string(topic);
}

std::string DdsTypeName(absl::string_view type) {
  const std::pair<absl::string_view, absl::string_view> sides =
      absl::StrSplit(type, absl::MaxSplits('/', 1));
  return absl::StrCat(sides.first, kTypeMiddle, sides.second, "_");
}

std::string RosTypeName(absl::string_view dds_type) {
  const std::size_t middle = dds_type.find(kTypeMiddle);
  if (middle == absl::string_view::npos) return "";
  absl::string_view name = dds_type.substr(middle + kTypeMiddle.size());
  if (!absl::ConsumeSuffix(&name, "_")) return "";
  return absl::StrCat(dds_type.substr(0, middle), "/", name);
}

absl::Status ValidateTopicName(absl::string_view topic) {
  bool good = absl::string_view(topic).substr(0, 1) == "/" && topic.size() <= kLongestName;
  for (const absl::string_view word : absl::StrSplit(topic.substr(good ? 1 : 0), '/')) {
    good = good && IsWord(word);
  }
  if (good) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("'", topic.substr(0, 100), "' is no topic's whole name, as in /ouster/points"));
}

const dds_topic_descriptor_t* DescriptorOf(absl::string_view type) {
  for (const NamedDescriptor& named : kDescriptors) {
    if (named.type == type) return named.descriptor;
  }
  return nullptr;
}

}  // namespace strata::ros2
