#include "client/formats/laz/laz_format.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/byte_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint16_t kPointwise = 1;
constexpr std::uint16_t kPointwiseChunks = 2;
constexpr std::uint16_t kLayeredChunks = 3;
constexpr std::uint32_t kChunksVary = 0xFFFFFFFF;
// What the record has between the options and the size of a chunk, and behind that.
constexpr std::size_t kVersionAndOptionsBytes = 8;
constexpr std::size_t kSpecialRecordsBytes = 16;

constexpr absl::string_view kCure =
    "'laszip -i IN.laz -o OUT.las' or 'pdal translate IN.laz OUT.las' makes LAS of it, which is "
    "read";

struct KnownItem {
  LazItemType type;
  absl::string_view name;
  std::uint16_t bytes;  // 0: any
  std::uint16_t first_version, last_version;
};
constexpr KnownItem kKnownItems[] = {
    {LazItemType::kByte, "BYTE", 0, 1, 2},
    {LazItemType::kPoint10, "POINT10", 20, 1, 2},
    {LazItemType::kGpsTime11, "GPSTIME11", 8, 1, 2},
    {LazItemType::kRgb12, "RGB12", 6, 1, 2},
    {LazItemType::kWavePacket13, "WAVEPACKET13", 29, 1, 1},
    {LazItemType::kPoint14, "POINT14", 30, 3, 4},
    {LazItemType::kRgb14, "RGB14", 6, 3, 4},
    {LazItemType::kRgbNir14, "RGBNIR14", 8, 3, 4},
    {LazItemType::kWavePacket14, "WAVEPACKET14", 29, 3, 4},
    {LazItemType::kByte14, "BYTE14", 0, 3, 4},
};

// What points of a format are made of, but for bytes that a program added.
std::vector<LazItemType> ItemsOf(int point_format) {
  using enum LazItemType;
  switch (point_format) {
    case 0:
      return {kPoint10};
    case 1:
      return {kPoint10, kGpsTime11};
    case 2:
      return {kPoint10, kRgb12};
    case 3:
      return {kPoint10, kGpsTime11, kRgb12};
    case 4:
      return {kPoint10, kGpsTime11, kWavePacket13};
    case 5:
      return {kPoint10, kGpsTime11, kRgb12, kWavePacket13};
    case 6:
      return {kPoint14};
    case 7:
      return {kPoint14, kRgb14};
    case 8:
      return {kPoint14, kRgbNir14};
    case 9:
      return {kPoint14, kWavePacket14};
    case 10:
      return {kPoint14, kRgbNir14, kWavePacket14};
    default:
      return {};
  }
}

absl::Status NotRead(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(what, "; ", kCure));
}

absl::Status CheckItem(const LazItem& item) {
  const auto* const known =
      std::find_if(std::begin(kKnownItems), std::end(kKnownItems), [&item](const KnownItem& k) {
        return k.type == item.type;
      });
  if (known == std::end(kKnownItems)) {
    return NotRead(absl::StrCat("points have an item of type ",
                                static_cast<std::uint16_t>(item.type),
                                ", which is not read"));
  }
  if (item.version < known->first_version || item.version > known->last_version) {
    return NotRead(absl::StrCat(
        "the item ",
        known->name,
        " is packed by version ",
        item.version,
        " of its coder; ",
        known->first_version == known->last_version
            ? absl::StrCat("version ", known->first_version, " is read")
            : absl::StrCat(
                  "versions ", known->first_version, " and ", known->last_version, " are read")));
  }
  if (item.bytes == known->bytes || (known->bytes == 0 && item.bytes > 0)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "the item ", known->name, " has ", item.bytes, " bytes; expected ", known->bytes));
}

absl::Status CheckCoder(std::uint16_t compressor, std::uint16_t coder) {
  if (compressor < kPointwise || compressor > kLayeredChunks) {
    return NotRead(absl::StrCat(
        "compressor ", compressor, "; 1 (no chunks), 2 (chunks) and 3 (layers) are read"));
  }
  if (coder != 0) return NotRead(absl::StrCat("coder ", coder, "; 0 (arithmetic) is read"));
  return absl::OkStatus();
}

// Whether the items make a point of the format, with or without bytes that a program added.
absl::Status CheckItems(const LazFormat& format, int point_format) {
  std::vector<LazItemType> expected = ItemsOf(point_format);
  std::vector<LazItemType> types;
  std::size_t bytes = 0;
  for (const LazItem& item : format.items) {
    STRATA_RETURN_IF_ERROR(CheckItem(item));
    types.push_back(item.type);
    bytes += item.bytes;
  }
  if (types.size() == expected.size() + 1) {
    expected.push_back(format.layered ? LazItemType::kByte14 : LazItemType::kByte);
  }
  const bool layered = expected.front() == LazItemType::kPoint14;
  if (types == expected && bytes == format.point_bytes && layered == format.layered) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("the record 'laszip encoded' has items of ",
                                                 bytes,
                                                 " bytes that do not make the points of ",
                                                 format.point_bytes,
                                                 " bytes and record format ",
                                                 point_format));
}

}  // namespace

absl::StatusOr<LazFormat> ReadLazFormat(absl::string_view record,
                                        int point_format,
                                        std::size_t point_bytes) {
  ByteCursor cursor(record);
  const auto compressor = cursor.Get<std::uint16_t>();
  const auto coder = cursor.Get<std::uint16_t>();
  cursor.Take(kVersionAndOptionsBytes);
  LazFormat format;
  format.layered = compressor == kLayeredChunks;
  format.chunked = compressor != kPointwise;
  format.point_bytes = point_bytes;
  format.chunk_points = cursor.Get<std::uint32_t>();
  cursor.Take(kSpecialRecordsBytes);
  format.items.resize(cursor.Get<std::uint16_t>());
  for (LazItem& item : format.items) {
    item.type = static_cast<LazItemType>(cursor.Get<std::uint16_t>());
    item.bytes = cursor.Get<std::uint16_t>();
    item.version = cursor.Get<std::uint16_t>();
  }
  if (!cursor.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the record 'laszip encoded' of ", record.size(), " bytes is cut short"));
  }
  STRATA_RETURN_IF_ERROR(CheckCoder(compressor, coder));
  STRATA_RETURN_IF_ERROR(CheckItems(format, point_format));
  if (format.chunked && format.chunk_points == 0) {
    return absl::InvalidArgumentError("chunks of 0 points; expected some, or 4294967295 for any");
  }
  if (format.chunk_points == kChunksVary) format.chunk_points = 0;
  return format;
}

}  // namespace strata
