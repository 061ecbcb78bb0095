#include "client/formats/survey/las_header.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/byte_source.h"
#include "client/formats/survey/las_units.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kHeaderBytes = 227;       // of versions 1.0 to 1.2
constexpr std::size_t kHeader14Bytes = 375;     // of version 1.4
constexpr std::uint8_t kCompressedBits = 0xC0;  // of the format, as LAZ marks it
constexpr std::uint16_t kTextBit = 1 << 4;      // of the encoding
constexpr std::size_t kMostRecords = 10'000;
constexpr std::uint64_t kExtendedHeadBytes = 60;  // of a record behind the points
// Of a record behind the points that is looked at; projections are texts of some kilobytes.
constexpr std::uint64_t kMostRecordBytes = 1 << 20;

constexpr LasFormat kLasFormats[] = {
    {20, 0, 0, false},
    {28, 20, 0, false},
    {26, 0, 20, false},
    {34, 20, 28, false},
    {57, 20, 0, false},
    {63, 20, 28, false},
    {30, 22, 0, true},
    {36, 22, 30, true},
    {38, 22, 30, true},
    {59, 22, 0, true},
    {67, 22, 30, true},
};

// The number at a place that is there; else 0.
template <typename T>
T NumberAt(absl::string_view bytes, std::size_t at) {
  return at <= bytes.size() ? ByteCursor(bytes.substr(at)).Get<T>() : T{};
}

absl::Status LasFault(std::uint64_t at, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("byte ", at, ": ", what));
}

absl::Status CheckLasStart(absl::string_view bytes) {
  if (!absl::StartsWith(bytes, "LASF")) return LasFault(0, "expected 'LASF', as LAS files begin");
  if (bytes.size() < kHeaderBytes) {
    return LasFault(bytes.size(), absl::StrCat("expected a header of ", kHeaderBytes, " bytes"));
  }
  const int major = bytes[24];
  const int minor = bytes[25];
  if (major != 1 || minor < 0 || minor > 4) {
    return LasFault(24, absl::StrCat("version ", major, ".", minor, "; 1.0 to 1.4 are read"));
  }
  const int format = NumberAt<std::uint8_t>(bytes, 104) & ~kCompressedBits;
  if (format < std::ssize(kLasFormats)) return absl::OkStatus();
  return LasFault(104, absl::StrCat("point record format ", format, "; 0 to 10 are read"));
}

absl::Status CheckLasHeader(const LasHeader& header, std::uint64_t file_bytes) {
  if (header.point_bytes < header.format.bytes) {
    return LasFault(105,
                    absl::StrCat("points of ",
                                 header.point_bytes,
                                 " bytes; those of format ",
                                 header.format_number,
                                 " need ",
                                 header.format.bytes));
  }
  const std::uint64_t there = header.points_at <= file_bytes ? file_bytes - header.points_at : 0;
  if (!header.compressed && header.points > there / header.point_bytes) {
    return LasFault(header.points_at,
                    absl::StrCat("expected ",
                                 header.points,
                                 " points of ",
                                 header.point_bytes,
                                 " bytes, there are ",
                                 there,
                                 " bytes: the file is cut short"));
  }
  if (!header.scale.allFinite() || !header.offset.allFinite() ||
      (header.scale.array() == 0).any()) {
    return LasFault(131, "expected finite scales and offsets, and no scale of 0");
  }
  return absl::OkStatus();
}

// Whether we look into records of this program.
bool Speaks(absl::string_view user) {
  return user == "LASF_Projection" || user == "liblas" || user == kLazUser;
}

// What stands before the bytes of a record; `length` of them.
LasRecord RecordHead(ByteCursor& cursor, bool extended, std::uint64_t& length) {
  cursor.Take(2);
  const absl::string_view user = cursor.Take(16);
  LasRecord record{.user = std::string(user.substr(0, user.find('\0'))), .bytes = {}};
  record.id = cursor.Get<std::uint16_t>();
  length = extended ? cursor.Get<std::uint64_t>() : cursor.Get<std::uint16_t>();
  cursor.Take(32);  // what it is, in words
  return record;
}

void AddRecords(absl::string_view bytes, std::uint32_t count, std::vector<LasRecord>& records) {
  ByteCursor cursor(bytes);
  for (std::uint32_t i = 0; i < count && i < kMostRecords; ++i) {
    std::uint64_t length = 0;
    LasRecord record = RecordHead(cursor, false, length);
    record.bytes = std::string(cursor.Take(length));
    if (!cursor.ok()) return;
    if (Speaks(record.user)) records.push_back(std::move(record));
  }
}

absl::Status AddExtendedRecords(ByteSource& source,
                                std::uint64_t at,
                                std::uint32_t count,
                                std::vector<LasRecord>& records) {
  std::string piece;
  for (std::uint32_t i = 0; i < count && i < kMostRecords; ++i) {
    STRATA_RETURN_IF_ERROR(source.Read(at, kExtendedHeadBytes, piece));
    ByteCursor cursor(piece);
    std::uint64_t length = 0;
    LasRecord record = RecordHead(cursor, true, length);
    if (!cursor.ok() || length > source.size() - at - kExtendedHeadBytes) break;
    at += kExtendedHeadBytes;
    if (Speaks(record.user) && length <= kMostRecordBytes) {
      STRATA_RETURN_IF_ERROR(source.Read(at, length, record.bytes));
      records.push_back(std::move(record));
    }
    at += length;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LasHeader> ReadLasHeader(ByteSource& source) {
  std::string bytes;
  STRATA_RETURN_IF_ERROR(source.Read(0, kHeader14Bytes, bytes));
  STRATA_RETURN_IF_ERROR(CheckLasStart(bytes));
  LasHeader header;
  header.minor = NumberAt<std::uint8_t>(bytes, 25);
  header.text_projection = (NumberAt<std::uint16_t>(bytes, 6) & kTextBit) != 0;
  header.header_bytes = NumberAt<std::uint16_t>(bytes, 94);
  header.points_at = NumberAt<std::uint32_t>(bytes, 96);
  header.records = NumberAt<std::uint32_t>(bytes, 100);
  const auto format = NumberAt<std::uint8_t>(bytes, 104);
  header.compressed = (format & kCompressedBits) != 0;
  header.format_number = format & ~kCompressedBits;
  header.format = kLasFormats[header.format_number];
  header.point_bytes = NumberAt<std::uint16_t>(bytes, 105);
  header.points = NumberAt<std::uint32_t>(bytes, 107);
  if (header.minor >= 4 && header.header_bytes >= kHeader14Bytes &&
      bytes.size() >= kHeader14Bytes) {
    header.points = NumberAt<std::uint64_t>(bytes, 247);
  }
  for (int k = 0; k < 3; ++k) {
    const std::size_t at = sizeof(double) * static_cast<std::size_t>(k);
    header.scale[k] = NumberAt<double>(bytes, 131 + at);
    header.offset[k] = NumberAt<double>(bytes, 155 + at);
  }
  STRATA_RETURN_IF_ERROR(CheckLasHeader(header, source.size()));
  return header;
}

absl::StatusOr<std::vector<LasRecord>> ReadLasRecords(ByteSource& source, const LasHeader& header) {
  std::vector<LasRecord> records;
  std::string piece;
  const std::uint64_t before = std::max<std::uint64_t>(header.points_at, header.header_bytes);
  STRATA_RETURN_IF_ERROR(source.Read(header.header_bytes, before - header.header_bytes, piece));
  AddRecords(piece, header.records, records);
  if (header.minor >= 4 && header.header_bytes >= kHeader14Bytes) {
    STRATA_RETURN_IF_ERROR(source.Read(235, 12, piece));
    ByteCursor cursor(piece);
    const auto at = cursor.Get<std::uint64_t>();
    STRATA_RETURN_IF_ERROR(AddExtendedRecords(source, at, cursor.Get<std::uint32_t>(), records));
  }
  return records;
}

}  // namespace strata
