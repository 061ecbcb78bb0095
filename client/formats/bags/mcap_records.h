// What MCAP's reader and writer agree on (https://mcap.dev/spec).
#ifndef STRATA_CLIENT_FORMATS_BAGS_MCAP_RECORDS_H_
#define STRATA_CLIENT_FORMATS_BAGS_MCAP_RECORDS_H_

#include <cstdint>

#include "absl/strings/string_view.h"

namespace strata {

inline constexpr absl::string_view kMcapMagic("\x89MCAP0\r\n", 8);

// Codes of records; each is followed by its length, 8 bytes.
enum McapOp : std::uint8_t {
  kMcapHeader = 0x01,
  kMcapFooter = 0x02,
  kMcapSchema = 0x03,
  kMcapChannel = 0x04,
  kMcapMessage = 0x05,
  kMcapChunk = 0x06,
  kMcapMessageIndex = 0x07,
  kMcapChunkIndex = 0x08,
  kMcapStatistics = 0x0B,
  kMcapSummaryOffset = 0x0E,
  kMcapDataEnd = 0x0F,
};
inline constexpr std::uint64_t kMcapRecordHead = 9;  // code and length

// Of zlib, which is MCAP's.
std::uint32_t Crc32Of(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_MCAP_RECORDS_H_
