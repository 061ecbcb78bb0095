// How the points of a LAZ file are packed: its record 'laszip encoded' 22204.
#ifndef STRATA_CLIENT_FORMATS_LAZ_LAZ_FORMAT_H_
#define STRATA_CLIENT_FORMATS_LAZ_LAZ_FORMAT_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// As the record numbers them.
enum class LazItemType : std::uint16_t {
  kByte = 0,
  kPoint10 = 6,
  kGpsTime11 = 7,
  kRgb12 = 8,
  kWavePacket13 = 9,
  kPoint14 = 10,
  kRgb14 = 11,
  kRgbNir14 = 12,
  kWavePacket14 = 13,
  kByte14 = 14,
};

struct LazItem {
  LazItemType type = LazItemType::kByte;
  std::uint16_t bytes = 0;
  std::uint16_t version = 0;
};

struct LazFormat {
  // Every attribute by itself, as for point record formats 6 to 10; else point by point.
  bool layered = false;
  // In pieces that can be read by themselves, as since LASzip 2.0.
  bool chunked = true;
  // Of every chunk but the last; 0: the chunk table says of each how many.
  std::uint32_t chunk_points = 0;
  // One behind the other they are the bytes of a point.
  std::vector<LazItem> items;
  std::size_t point_bytes = 0;
};

// Of points of a record format (0 to 10) and so many bytes. INVALID_ARGUMENT naming what is not
// read and what makes of it what is: items that do not make such a point, of other versions than
// LASzip has had.
absl::StatusOr<LazFormat> ReadLazFormat(absl::string_view record,
                                        int point_format,
                                        std::size_t point_bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_LAZ_FORMAT_H_
