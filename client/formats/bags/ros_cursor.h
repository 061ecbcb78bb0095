// The values of a ROS message one after the other.
#ifndef STRATA_CLIENT_FORMATS_BAGS_ROS_CURSOR_H_
#define STRATA_CLIENT_FORMATS_BAGS_ROS_CURSOR_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/ros_topic.h"
#include "client/formats/parsing/byte_cursor.h"

namespace strata {

// In CDR (OMG DDSI-RTPS 9.4.2.13, XTypes 7.4) each number stands at a multiple of its size, counted
// from behind the four bytes that say which CDR it is; in ROS 1 they stand close, little-endian.
class RosCursor {
 public:
  // INVALID_ARGUMENT for encodings other than plain CDR, version 1 or 2, and ROS 1's.
  static absl::StatusOr<RosCursor> Create(absl::string_view message, MessageEncoding encoding) {
    if (encoding == MessageEncoding::kRos1) return RosCursor(message, false, 1);
    if (encoding != MessageEncoding::kCdr) {
      return absl::InvalidArgumentError("the message is neither CDR nor of ROS 1");
    }
    if (message.size() < kHead) return absl::InvalidArgumentError("the message has no CDR header");
    // Options follow in the last two bytes.
    const int kind =
        static_cast<unsigned char>(message[0]) << 8 | static_cast<unsigned char>(message[1]);
    message.remove_prefix(kHead);
    if (kind == 0 || kind == 1) return RosCursor(message, kind == 0, 8);
    if (kind == 6 || kind == 7) return RosCursor(message, kind == 6, 4);
    return absl::InvalidArgumentError(
        absl::StrCat("the message is CDR of kind ", kind, "; 0, 1, 6 and 7 are read"));
  }

  bool is_ros1() const { return largest_step_ == 1; }

  template <typename T>
  T Get() {
    const std::size_t step = std::min(sizeof(T), largest_step_);
    cursor_.Take((step - cursor_.position() % step) % step);
    return cursor_.Get<T>();
  }
  absl::string_view Text() {
    absl::string_view text = Bytes();
    if (!is_ros1() && !text.empty()) text.remove_suffix(1);  // a zero
    return text;
  }
  // A sequence of bytes.
  absl::string_view Bytes() { return cursor_.Take(Get<std::uint32_t>()); }

  std::size_t remaining() const { return cursor_.remaining(); }
  absl::Status status() const {
    return cursor_.ok() ? absl::OkStatus() : absl::InvalidArgumentError("the message is cut short");
  }

 private:
  static constexpr std::size_t kHead = 4;

  RosCursor(absl::string_view message, bool big_endian, std::size_t largest_step)
      : cursor_(message, big_endian), largest_step_(largest_step) {}

  ByteCursor cursor_;
  std::size_t largest_step_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_ROS_CURSOR_H_
