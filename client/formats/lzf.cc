#include "client/formats/lzf.h"

#include <cstddef>
#include <limits>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <liblzf/lzf.h>

namespace strata {
namespace {

constexpr std::size_t kLongestCopy = 264;  // made of 3 bytes
constexpr std::size_t kMost = std::numeric_limits<unsigned int>::max();

}  // namespace

absl::StatusOr<std::string> DecompressLzf(absl::string_view packed, std::size_t size) {
  if (size / kLongestCopy > packed.size() || packed.size() > kMost || size > kMost) {
    return absl::InvalidArgumentError(absl::StrCat(
        packed.size(), " compressed bytes cannot hold the ", size, " bytes announced"));
  }
  std::string out(size, '\0');
  if (packed.empty() && size == 0) return out;
  const unsigned int done = lzf_decompress(packed.data(),
                                           static_cast<unsigned int>(packed.size()),
                                           out.data(),
                                           static_cast<unsigned int>(size));
  if (done == size) return out;
  return absl::InvalidArgumentError(absl::StrCat(
      packed.size(), " compressed bytes do not decompress to the ", size, " bytes announced"));
}

}  // namespace strata
