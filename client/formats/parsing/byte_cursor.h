// Numbers and pieces off the front of bytes that somebody else wrote.
#ifndef STRATA_CLIENT_FORMATS_PARSING_BYTE_CURSOR_H_
#define STRATA_CLIENT_FORMATS_PARSING_BYTE_CURSOR_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "absl/strings/string_view.h"

namespace strata {

// Past the end it gives zeros and empty pieces, and ok() is false from then on: who has read a
// whole record asks once. The bytes must outlive it.
class ByteCursor {
 public:
  explicit ByteCursor(absl::string_view bytes, bool big_endian = false)
      : bytes_(bytes), swapped_(big_endian != (std::endian::native == std::endian::big)) {}

  template <typename T>
  T Get() {
    std::array<char, sizeof(T)> raw{};
    const absl::string_view taken = Take(sizeof(T));
    if (!taken.empty()) std::memcpy(raw.data(), taken.data(), sizeof(T));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }

  absl::string_view Take(std::uint64_t count) {
    if (count > remaining()) {
      ok_ = false;
      position_ = bytes_.size();
      return {};
    }
    position_ += static_cast<std::size_t>(count);
    return bytes_.substr(position_ - static_cast<std::size_t>(count),
                         static_cast<std::size_t>(count));
  }
  // A piece behind its length, a number of type Length.
  template <typename Length>
  absl::string_view TakeSized() {
    return Take(Get<Length>());
  }
  absl::string_view TakeRest() { return Take(remaining()); }

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }
  bool ok() const { return ok_; }

 private:
  absl::string_view bytes_;
  std::size_t position_ = 0;
  bool swapped_;
  bool ok_ = true;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_BYTE_CURSOR_H_
