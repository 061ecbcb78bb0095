#include "client/formats/bags/ros_topic.h"

#include <cstddef>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

constexpr std::size_t kMaxNameLength = 200;

}  // namespace

MessageEncoding MessageEncodingOf(absl::string_view name) {
  if (name == "cdr") return MessageEncoding::kCdr;
  return name == "ros1" ? MessageEncoding::kRos1 : MessageEncoding::kUnknown;
}

std::string PrintableName(absl::string_view name) {
  std::string printable(name.substr(0, kMaxNameLength));
  for (char& c : printable) {
    if (!absl::ascii_isprint(static_cast<unsigned char>(c))) c = '?';
  }
  return printable;
}

}  // namespace strata
