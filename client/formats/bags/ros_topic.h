// What topics of ROS 1 and ROS 2 are called, and how their messages are laid out.
#ifndef STRATA_CLIENT_FORMATS_BAGS_ROS_TOPIC_H_
#define STRATA_CLIENT_FORMATS_BAGS_ROS_TOPIC_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace strata {

// How the bytes of a message are laid out: OMG's CDR (ROS 2), or ROS 1's own.
enum class MessageEncoding : std::uint8_t { kCdr, kRos1, kUnknown };
MessageEncoding MessageEncodingOf(absl::string_view name);  // "cdr", "ros1"

// A name out of a file, fit to be shown: at most 200 characters, '?' for those that are not
// printable ASCII, of which names in ROS are.
std::string PrintableName(absl::string_view name);

struct BagTopic {
  std::string name;
  std::string type;  // "sensor_msgs/PointCloud2": without the /msg/ of ROS 2
  MessageEncoding encoding = MessageEncoding::kUnknown;

  friend bool operator==(const BagTopic&, const BagTopic&) = default;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_ROS_TOPIC_H_
