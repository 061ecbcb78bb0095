#include "client/formats/lzf.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

constexpr std::size_t kLongestCopy = 264;  // made of 3 bytes
// Of the output at a time: a processor's cache keeps it between filling with zeros and writing.
constexpr std::size_t kGrowth = 1 << 16;

absl::Status Broken(std::size_t position) {
  return absl::InvalidArgumentError(
      absl::StrCat("compressed data do not decompress at their byte ", position));
}

// What is copied may be what this copies.
void CopyFromBack(char* to, std::size_t back, std::size_t length) {
  if (length <= back) {
    std::memcpy(to, to - back, length);
  } else {
    for (std::size_t k = 0; k < length; ++k) to[k] = *(to + k - back);
  }
}

}  // namespace

absl::StatusOr<std::string> DecompressLzf(absl::string_view packed, std::size_t size) {
  if (size / kLongestCopy > packed.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        packed.size(), " compressed bytes cannot hold the ", size, " bytes announced"));
  }
  std::string out;
  out.reserve(size);
  std::size_t done = 0;
  for (std::size_t i = 0; i < packed.size();) {
    if (out.size() - done < kLongestCopy) out.resize(std::min(size, done + kGrowth));
    const auto byte = [&](std::size_t k) -> std::size_t {
      return static_cast<std::uint8_t>(packed[i + k]);
    };
    const std::size_t control = byte(0);
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > packed.size() - i - 1 || length > size - done) return Broken(i);
      std::memcpy(out.data() + done, packed.data() + i + 1, length);
      done += length;
      i += 1 + length;
      continue;
    }
    const bool is_long = control >> 5 == 7;
    const std::size_t used = is_long ? 3 : 2;
    if (used > packed.size() - i) return Broken(i);
    const std::size_t length = (control >> 5) + 2 + (is_long ? byte(1) : 0);
    const std::size_t back = (control & 31) * 256 + byte(used - 1) + 1;
    if (back > done || length > size - done) return Broken(i);
    CopyFromBack(out.data() + done, back, length);
    done += length;
    i += used;
  }
  if (done != size) return Broken(packed.size());
  return out;
}

}  // namespace strata
