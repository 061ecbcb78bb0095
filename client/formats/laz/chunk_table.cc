#include "client/formats/laz/chunk_table.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/byte_source.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint64_t kPlaceBytes = 8;
// Of a table: its version and how many chunks there are.
constexpr std::uint64_t kTableHeadBytes = 8;
// No two numbers of a chunk take more: each has its length, modelled bits and 24 others.
constexpr std::uint64_t kMostEntryBytes = 16;
constexpr std::uint64_t kMostPointsAByte = 200;

// Contexts of the numbers of a chunk.
constexpr std::size_t kPointsContext = 0;
constexpr std::size_t kBytesContext = 1;

absl::Status TableFault(std::uint64_t at, absl::string_view what) {
  return absl::InvalidArgumentError(
      absl::StrCat("byte ", at, ": ", what, "; 'laszip -i IN.laz -o OUT.las' may still read it"));
}

// The table's place stands before the first chunk, or at the end of a file that was not written
// from the front to the back.
absl::StatusOr<std::uint64_t> PlaceOfTable(ByteSource& source, std::uint64_t points_at) {
  std::string piece;
  STRATA_RETURN_IF_ERROR(source.Read(points_at, kPlaceBytes, piece));
  auto place = ByteCursor(piece).Get<std::int64_t>();
  if (place == -1 && source.size() >= kPlaceBytes) {
    STRATA_RETURN_IF_ERROR(source.Read(source.size() - kPlaceBytes, kPlaceBytes, piece));
    place = ByteCursor(piece).Get<std::int64_t>();
  }
  const auto at = static_cast<std::uint64_t>(place);
  if (place >= 0 && at >= points_at + kPlaceBytes && at + kTableHeadBytes <= source.size()) {
    return at;
  }
  return TableFault(
      points_at,
      "no place of a chunk table within the file, which was not finished or is cut short");
}

struct TableHead {
  std::uint64_t at = 0;
  std::uint64_t chunks = 0;
};

absl::StatusOr<TableHead> ReadTableHead(ByteSource& source,
                                        std::uint64_t points_at,
                                        const LazFormat& format) {
  TableHead head;
  STRATA_ASSIGN_OR_RETURN(head.at, PlaceOfTable(source, points_at));
  std::string piece;
  STRATA_RETURN_IF_ERROR(source.Read(head.at, kTableHeadBytes, piece));
  ByteCursor cursor(piece);
  const auto version = cursor.Get<std::uint32_t>();
  head.chunks = cursor.Get<std::uint32_t>();
  if (version != 0)
    return TableFault(head.at, absl::StrCat("chunk table of version ", version, "; 0 is read"));
  // Every chunk has its first point as it is.
  const std::uint64_t most = (head.at - points_at - kPlaceBytes) / format.point_bytes;
  if (head.chunks <= most) return head;
  return TableFault(head.at, absl::StrCat(head.chunks, " chunks; there is room for ", most));
}

// One after the other, each number as what it differs by from that of the chunk before.
absl::StatusOr<std::vector<LazChunk>> ReadChunks(ByteSource& source,
                                                 const TableHead& head,
                                                 bool counts_vary) {
  std::string piece;
  STRATA_RETURN_IF_ERROR(
      source.Read(head.at + kTableHeadBytes, (head.chunks + 1) * kMostEntryBytes, piece));
  ArithmeticDecoder decoder(piece);
  IntegerDecoder numbers(32, 2);
  std::vector<LazChunk> chunks(head.chunks);
  std::int32_t points = 0;
  std::int32_t bytes = 0;
  for (LazChunk& chunk : chunks) {
    if (counts_vary) points = numbers.Next(decoder, points, kPointsContext);
    bytes = numbers.Next(decoder, bytes, kBytesContext);
    chunk.points = static_cast<std::uint32_t>(points);
    chunk.bytes = static_cast<std::uint32_t>(bytes);
  }
  if (decoder.ok()) return chunks;
  return TableFault(head.at, "the chunk table is cut short");
}

absl::Status CheckChunk(const LazChunk& chunk, std::uint64_t end, const LazFormat& format) {
  if (chunk.bytes > end - chunk.at || (chunk.points > 0 && chunk.bytes < format.point_bytes)) {
    return TableFault(chunk.at,
                      absl::StrCat("a chunk of ",
                                   chunk.bytes,
                                   " bytes before byte ",
                                   end,
                                   ", of points of ",
                                   format.point_bytes));
  }
  if (chunk.points / kMostPointsAByte <= chunk.bytes) return absl::OkStatus();
  return TableFault(chunk.at,
                    absl::StrCat("a chunk of ",
                                 chunk.bytes,
                                 " bytes for ",
                                 chunk.points,
                                 " points; at most ",
                                 kMostPointsAByte,
                                 " a byte are read"));
}

// All that is behind the points' beginning: before LASzip 2.0 there was no table.
absl::StatusOr<std::vector<LazChunk>> OneChunk(const ByteSource& source,
                                               std::uint64_t points_at,
                                               std::uint64_t points,
                                               const LazFormat& format) {
  if (points_at > source.size()) return TableFault(points_at, "the points lie behind the end");
  const LazChunk chunk = {.at = points_at, .bytes = source.size() - points_at, .points = points};
  STRATA_RETURN_IF_ERROR(CheckChunk(chunk, source.size(), format));
  return std::vector<LazChunk>{chunk};
}

}  // namespace

absl::StatusOr<std::vector<LazChunk>> ReadChunkTable(ByteSource& source,
                                                     std::uint64_t points_at,
                                                     std::uint64_t points,
                                                     const LazFormat& format) {
  if (points == 0) return std::vector<LazChunk>();
  if (!format.chunked) return OneChunk(source, points_at, points, format);
  STRATA_ASSIGN_OR_RETURN(const TableHead head, ReadTableHead(source, points_at, format));
  const bool counts_vary = format.chunk_points == 0;
  STRATA_ASSIGN_OR_RETURN(std::vector<LazChunk> chunks, ReadChunks(source, head, counts_vary));
  std::uint64_t at = points_at + kPlaceBytes;
  std::uint64_t left = points;
  for (LazChunk& chunk : chunks) {
    if (!counts_vary) chunk.points = std::min<std::uint64_t>(left, format.chunk_points);
    if (chunk.points > left) break;
    chunk.at = at;
    STRATA_RETURN_IF_ERROR(CheckChunk(chunk, head.at, format));
    at += chunk.bytes;
    left -= chunk.points;
  }
  std::uint64_t found = 0;
  for (const LazChunk& chunk : chunks) found += chunk.points;
  if (found != points)
    return TableFault(
        head.at,
        absl::StrCat(chunks.size(), " chunks of ", found, " points; the header says ", points));
  std::erase_if(chunks, [](const LazChunk& chunk) { return chunk.points == 0; });
  return chunks;
}

}  // namespace strata
