#include "core/planning/packed_tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <zstd.h>

#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/least_dangers.h"
#include "core/planning/move_cost.h"
#include "core/planning/patch_index.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

constexpr std::uint32_t kFormat = 2;
constexpr int kLevel = 1;  // of zstd: 3 saves another twentieth and takes twice the time
// Format, size of the columns, size of cells, packed size of the first columns.
constexpr std::size_t kHeaderBytes = 20;
constexpr std::uint64_t kFirstColumnBytes = 20 + 2 * PatchIndex::kBlocks;
constexpr std::size_t kChecksumBytes = 8;
// No tile that fits a map has as much.
constexpr std::uint64_t kMaxColumnBytes = std::uint64_t{1} << 28;

void PutNumber(std::string& out, std::uint64_t value, int bytes) {
  for (int byte = 0; byte < bytes; ++byte) out.push_back(static_cast<char>(value >> (8 * byte)));
}
std::uint64_t NumberAt(absl::string_view bytes, std::size_t at, int count) {
  std::uint64_t value = 0;
  for (int byte = 0; byte < count; ++byte) {
    value |= std::uint64_t{static_cast<std::uint8_t>(bytes[at + byte])} << (8 * byte);
  }
  return value;
}

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("prepared tile: ", what));
}

// Columns of whole numbers, byte by byte: what is alike lies together.
class ColumnWriter {
 public:
  template <typename T>
  void Put(const std::vector<T>& values) {
    static_assert(std::is_unsigned_v<T>);
    PutNumber(bytes_, values.size(), 4);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (const T value : values) {
        bytes_.push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * byte)));
      }
    }
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class ColumnReader {
 public:
  explicit ColumnReader(absl::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  std::vector<T> Take() {
    static_assert(std::is_unsigned_v<T>);
    if (bytes_.size() < 4) return Fail<T>();
    const std::uint64_t count = NumberAt(bytes_, 0, 4);
    bytes_.remove_prefix(4);
    if (count * sizeof(T) > bytes_.size()) return Fail<T>();
    std::vector<T> values(count, 0);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto bits = std::uint64_t{static_cast<std::uint8_t>(bytes_[byte * count + i])};
        values[i] = static_cast<T>(values[i] | bits << (8 * byte));
      }
    }
    bytes_.remove_prefix(count * sizeof(T));
    return values;
  }
  // True if all was there, and nothing else.
  bool Finished() const { return ok_ && bytes_.empty(); }

 private:
  template <typename T>
  std::vector<T> Fail() {
    ok_ = false;
    bytes_ = absl::string_view();
    return {};
  }

  absl::string_view bytes_;
  bool ok_ = true;
};

// Differences between neighbours are small.
template <typename T>
std::vector<T> Differences(const std::vector<T>& values) {
  std::vector<T> differences;
  differences.reserve(values.size());
  T last = 0;
  for (const T value : values) {
    const auto step = static_cast<std::make_signed_t<T>>(static_cast<T>(value - last));
    differences.push_back(static_cast<T>(static_cast<T>(value - last) << 1 ^ (step < 0 ? -1 : 0)));
    last = value;
  }
  return differences;
}
template <typename T>
std::vector<T> Sums(std::vector<T> values) {
  T last = 0;
  for (T& value : values) {
    last = static_cast<T>(last + (value >> 1 ^ ((value & 1) != 0 ? -1 : 0)));
    value = last;
  }
  return values;
}

template <typename Row, typename T>
std::vector<T> ColumnOf(const std::vector<Row>& rows, T Row::*member) {
  std::vector<T> column;
  column.reserve(rows.size());
  for (const Row& row : rows) column.push_back(row.*member);
  return column;
}
// False if it is not as long.
template <typename Row, typename T>
bool SetColumn(std::vector<Row>& rows, T Row::*member, const std::vector<T>& column) {
  if (column.size() != rows.size()) return false;
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].*member = column[i];
  return true;
}

void PutIndex(ColumnWriter& columns, const PatchIndex& index) {
  columns.Put(index.sheets());
  columns.Put(index.upper_blocks());
}
bool TakeIndex(ColumnReader& columns, PatchIndex* index) {
  auto sheets = columns.Take<std::uint64_t>();
  auto upper_blocks = columns.Take<std::uint16_t>();
  std::optional<PatchIndex> made = PatchIndex::OfSheets(std::move(sheets), std::move(upper_blocks));
  if (made.has_value()) *index = *std::move(made);
  return made.has_value();
}

std::vector<std::uint32_t> Bits(const std::vector<float>& values) {
  std::vector<std::uint32_t> bits;
  for (const float value : values) bits.push_back(std::bit_cast<std::uint32_t>(value));
  return bits;
}

bool TakeHeights(ColumnReader& columns, PreparedTile& tile) {
  const auto base = columns.Take<std::uint32_t>();
  if (base.size() != 1) return false;
  tile.base_steps = std::bit_cast<std::int32_t>(base.front());
  const bool fit =
      SetColumn(tile.patches, &PreparedPatch::height, Sums(columns.Take<std::uint16_t>()));
  tile.other_heights = Sums(columns.Take<std::uint16_t>());
  for (const std::uint32_t bits : columns.Take<std::uint32_t>()) {
    tile.exact_heights.push_back(std::bit_cast<float>(bits));
    if (!std::isfinite(tile.exact_heights.back())) return false;
  }
  return fit && std::abs(std::int64_t{tile.base_steps}) < 1 << 24 &&
         tile.other_heights.size() == tile.other.size() &&
         (tile.exact_heights.empty() ||
          tile.exact_heights.size() == tile.standing.size() + tile.other.size());
}

// Searches look for targets without looking where the tile ends.
bool MovesLeadSomewhere(const PreparedTile& tile) {
  bool all = true;
  tile.standing.ForEach([&](std::uint32_t place, std::uint32_t number) {
    const std::uint16_t cell = tile.standing.CellOf(place);
    if (tile.standing.HasAllAround(place)) return;
    for (unsigned k = 0; k < 8; ++k) {
      if ((tile.patches[number].moves >> k & 1U) == 0) continue;
      int x = cell & (kTileCells - 1);
      int y = cell >> kTileShift;
      bool found = false;
      while (!found) {
        x += kStepX[k];
        y += kStepY[k];
        if (x < 0 || y < 0 || x >= kTileCells || y >= kTileCells) break;
        const auto to = static_cast<std::uint16_t>(y << kTileShift | x);
        found = tile.standing.Has(PatchIndex::FirstSheetPlace(to));
      }
      all = all && found;
    }
  });
  return all;
}

bool FarMovesFit(const PreparedTile& tile) {
  for (std::size_t i = 0; i < tile.far_moves.size(); ++i) {
    const FarMove& move = tile.far_moves[i];
    if (!tile.standing.Has(move.place) || move.direction >= 8 || move.cells < 1 ||
        move.cells > kTileCells || move.cost == 0 || move.cost > kDearestMove) {
      return false;
    }
    if (i == 0) continue;
    const FarMove& last = tile.far_moves[i - 1];
    if (std::tie(last.place, last.direction) >= std::tie(move.place, move.direction)) return false;
  }
  return true;
}

absl::StatusOr<std::string> Decompressed(absl::string_view packed, std::uint64_t size) {
  std::string columns(size, '\0');
  const std::size_t used =
      ZSTD_decompress(columns.data(), columns.size(), packed.data(), packed.size());
  if (ZSTD_isError(used) != 0U || used != size) return Damaged("columns cannot be decompressed");
  return columns;
}

absl::StatusOr<PreparedTile> TileOfColumns(const TileKey& key, absl::string_view raw) {
  ColumnReader columns(raw);
  PreparedTile tile;
  tile.key = key;
  if (!TakeIndex(columns, &tile.standing) || !TakeIndex(columns, &tile.other)) {
    return Damaged("sheets that contradict each other");
  }
  tile.patches.resize(tile.standing.size());
  if (!SetColumn(tile.patches, &PreparedPatch::moves, columns.Take<std::uint8_t>()) ||
      !SetColumn(tile.patches, &PreparedPatch::edge_distance, columns.Take<std::uint8_t>()) ||
      !SetColumn(tile.patches, &PreparedPatch::danger, columns.Take<std::uint16_t>()) ||
      !TakeHeights(columns, tile)) {
    return Damaged("columns that do not fit the patches");
  }
  tile.class_id = columns.Take<std::uint8_t>();
  const auto places = Sums(columns.Take<std::uint32_t>());
  tile.far_moves.resize(places.size());
  if ((!tile.class_id.empty() && tile.class_id.size() != tile.standing.size()) ||
      !SetColumn(tile.far_moves, &FarMove::place, places) ||
      !SetColumn(tile.far_moves, &FarMove::direction, columns.Take<std::uint8_t>()) ||
      !SetColumn(tile.far_moves, &FarMove::level, columns.Take<std::uint8_t>()) ||
      !SetColumn(tile.far_moves, &FarMove::cells, columns.Take<std::uint16_t>()) ||
      !SetColumn(tile.far_moves, &FarMove::cost, columns.Take<std::uint32_t>()) ||
      !columns.Finished() || !FarMovesFit(tile) || !MovesLeadSomewhere(tile)) {
    return Damaged("moves that lead nowhere");
  }
  IndexFarMoves(tile);
  return tile;
}

// Apart from the others, as most who ask for them need nothing else.
std::string FirstColumns(const TileKey& key, const LeastDangers& least) {
  ColumnWriter columns;
  columns.Put(std::vector<std::uint32_t>{static_cast<std::uint32_t>(key.level),
                                         static_cast<std::uint32_t>(key.x),
                                         static_cast<std::uint32_t>(key.y)});
  columns.Put(std::vector<std::uint16_t>(least.begin(), least.end()));
  return columns.bytes();
}

absl::StatusOr<PackedLeastDangers> FirstOfColumns(absl::string_view raw) {
  ColumnReader columns(raw);
  const auto key = columns.Take<std::uint32_t>();
  const auto least = columns.Take<std::uint16_t>();
  PackedLeastDangers first;
  if (!columns.Finished() || key.size() != 3 || least.size() != first.least.size()) {
    return Damaged("no key or no dangers");
  }
  first.key = {std::bit_cast<std::int32_t>(key[0]),
               std::bit_cast<std::int32_t>(key[1]),
               std::bit_cast<std::int32_t>(key[2])};
  std::copy(least.begin(), least.end(), first.least.begin());
  return first;
}

std::string Compressed(absl::string_view raw) {
  std::string packed(ZSTD_compressBound(raw.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), kLevel));
  return packed;
}

// What was packed, between header and checksum.
absl::StatusOr<absl::string_view> IntactBody(absl::string_view packed, double cell_size_m) {
  if (packed.size() < kHeaderBytes + kChecksumBytes) return Damaged("cut short");
  const absl::string_view body = packed.substr(0, packed.size() - kChecksumBytes);
  if (Checksum64(body) != NumberAt(packed, body.size(), 8)) return Damaged("wrong checksum");
  if (const std::uint64_t format = NumberAt(body, 0, 4); format != kFormat) {
    return Damaged(absl::StrCat("format ", format, " is not ", kFormat));
  }
  if (NumberAt(body, 8, 8) != std::bit_cast<std::uint64_t>(cell_size_m)) {
    return Damaged(absl::StrCat("not of cells of ", cell_size_m, " m"));
  }
  if (NumberAt(body, 16, 4) > body.size() - kHeaderBytes) return Damaged("cut short");
  return body.substr(kHeaderBytes);
}

absl::StatusOr<PackedLeastDangers> FirstOfBody(absl::string_view body, std::uint64_t size) {
  STRATA_ASSIGN_OR_RETURN(const std::string raw,
                          Decompressed(body.substr(0, size), kFirstColumnBytes));
  return FirstOfColumns(raw);
}

}  // namespace

std::string PackTile(const PreparedTile& tile, double cell_size_m) {
  return PackTile(tile, LeastDangersOf(tile), cell_size_m);
}

std::string PackTile(const PreparedTile& tile, const LeastDangers& least, double cell_size_m) {
  ColumnWriter columns;
  PutIndex(columns, tile.standing);
  PutIndex(columns, tile.other);
  columns.Put(ColumnOf(tile.patches, &PreparedPatch::moves));
  columns.Put(ColumnOf(tile.patches, &PreparedPatch::edge_distance));
  columns.Put(ColumnOf(tile.patches, &PreparedPatch::danger));
  columns.Put(std::vector<std::uint32_t>{std::bit_cast<std::uint32_t>(tile.base_steps)});
  columns.Put(Differences(ColumnOf(tile.patches, &PreparedPatch::height)));
  columns.Put(Differences(tile.other_heights));
  columns.Put(Bits(tile.exact_heights));
  columns.Put(tile.class_id);
  columns.Put(Differences(ColumnOf(tile.far_moves, &FarMove::place)));
  columns.Put(ColumnOf(tile.far_moves, &FarMove::direction));
  columns.Put(ColumnOf(tile.far_moves, &FarMove::level));
  columns.Put(ColumnOf(tile.far_moves, &FarMove::cells));
  columns.Put(ColumnOf(tile.far_moves, &FarMove::cost));

  const std::string first = Compressed(FirstColumns(tile.key, least));
  std::string packed;
  PutNumber(packed, kFormat, 4);
  PutNumber(packed, columns.bytes().size(), 4);
  PutNumber(packed, std::bit_cast<std::uint64_t>(cell_size_m), 8);
  PutNumber(packed, first.size(), 4);
  absl::StrAppend(&packed, first, Compressed(columns.bytes()));
  PutNumber(packed, Checksum64(packed), kChecksumBytes);
  packed.shrink_to_fit();
  return packed;
}

absl::StatusOr<PackedLeastDangers> UnpackLeastDangers(absl::string_view packed,
                                                      double cell_size_m) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body, IntactBody(packed, cell_size_m));
  return FirstOfBody(body, NumberAt(packed, 16, 4));
}

absl::StatusOr<PreparedTile> UnpackTile(absl::string_view packed, double cell_size_m) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body, IntactBody(packed, cell_size_m));
  const std::uint64_t size = NumberAt(packed, 4, 4);
  if (size > kMaxColumnBytes) return Damaged(absl::StrCat(size, " bytes of columns"));
  const std::uint64_t first_size = NumberAt(packed, 16, 4);
  STRATA_ASSIGN_OR_RETURN(const PackedLeastDangers first, FirstOfBody(body, first_size));
  STRATA_ASSIGN_OR_RETURN(const std::string raw, Decompressed(body.substr(first_size), size));
  STRATA_ASSIGN_OR_RETURN(PreparedTile tile, TileOfColumns(first.key, raw));
  if (LeastDangersOf(tile) != first.least) return Damaged("dangers of other patches");
  return tile;
}

}  // namespace strata
