#include "client/formats/bags/mcap_records.h"

#include <cstdint>

#include "absl/strings/string_view.h"
#include <zlib.h>

namespace strata {

std::uint32_t Crc32Of(absl::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace strata
