#include "core/codec/occupancy.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/codec/columns.h"
#include "core/common/status.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr int kCells = kTileCells * kTileCells;
constexpr unsigned kManyCode = 3;  // this many or more; the rest follows as a varint
constexpr std::size_t kMaxVarintBytes = 5;

// Four cells in a square share a byte: neighbours in both directions tell about each other.
int BlockOf(int cell) {
  return (cell >> (kTileShift + 1)) * (kTileCells / 2) + (cell % kTileCells) / 2;
}
int ShiftInBlock(int cell) { return 2 * ((cell >> kTileShift & 1) * 2 + (cell & 1)); }

}  // namespace

void PutCells(std::string& out, std::span<const std::uint16_t> cells) {
  std::string codes(kCells / 4, '\0');
  std::string rest;
  for (std::size_t i = 0; i < cells.size();) {
    std::size_t end = i + 1;
    while (end < cells.size() && cells[end] == cells[i]) ++end;
    const std::size_t count = end - i;
    const auto code = static_cast<unsigned>(std::min<std::size_t>(count, kManyCode));
    char& block = codes[BlockOf(cells[i])];
    block = static_cast<char>(block | code << ShiftInBlock(cells[i]));
    if (code == kManyCode) PutVarint(rest, count - kManyCode);
    i = end;
  }
  PutColumn(out, codes);
  PutColumn(out, rest);
}

absl::StatusOr<std::vector<std::uint16_t>> TakeCells(ByteReader& reader, std::size_t max_surfaces) {
  std::string codes;
  std::string rest;
  STRATA_RETURN_IF_ERROR(TakeColumn(reader, kCells / 4, codes));
  STRATA_RETURN_IF_ERROR(TakeColumn(reader, kCells * kMaxVarintBytes, rest));
  if (codes.size() != kCells / 4) {
    return absl::DataLossError(absl::StrCat("occupancy of ", 4 * codes.size(), " cells"));
  }
  std::vector<std::uint16_t> cells;
  ByteReader rest_reader(rest);
  const std::string empty_row(kTileCells / 2, '\0');
  for (int cell = 0; cell < kCells; ++cell) {
    if (cell % kTileCells == 0 && codes.compare(BlockOf(cell), empty_row.size(), empty_row) == 0) {
      cell += kTileCells - 1;
      continue;
    }
    std::uint64_t count =
        static_cast<std::uint8_t>(codes[BlockOf(cell)]) >> ShiftInBlock(cell) & 3U;
    if (count == 0) continue;
    if (count == kManyCode) count += rest_reader.Varint();
    if (!rest_reader.ok() || count > max_surfaces - cells.size()) {
      return absl::DataLossError(absl::StrCat("more than ", max_surfaces, " surfaces in a tile"));
    }
    cells.insert(cells.end(), count, static_cast<std::uint16_t>(cell));
  }
  if (rest_reader.remaining() != 0) return absl::DataLossError("occupancy: bytes left over");
  return cells;
}

std::vector<SurfacesBeside> FindNeighbours(std::span<const std::uint16_t> cells) {
  // begin[x + 1]: first surface of cell x of the row, with an empty cell on either side.
  std::array<std::uint32_t, kTileCells + 3> above{};
  std::array<std::uint32_t, kTileCells + 3> here{};
  const auto layer_of = [](const auto& begin, int x, std::uint32_t layer) {
    const std::uint32_t first = begin[x + 1];
    const std::uint32_t count = begin[x + 2] - first;
    return count == 0 ? SurfacesBeside::kNone : first + std::min(layer, count - 1);
  };
  std::vector<SurfacesBeside> neighbours(cells.size());
  std::uint32_t i = 0;
  for (int y = 0; y < kTileCells && i < cells.size(); ++y) {
    here[0] = i;
    for (int x = 0; x < kTileCells; ++x) {
      here[x + 1] = i;
      const int cell = y << kTileShift | x;
      for (std::uint32_t layer = 0; i < cells.size() && cells[i] == cell; ++i, ++layer) {
        neighbours[i] = {.left = layer_of(here, x - 1, layer),
                         .up = layer_of(above, x, layer),
                         .up_left = layer_of(above, x - 1, layer),
                         .up_right = layer_of(above, x + 1, layer)};
      }
    }
    here[kTileCells + 1] = here[kTileCells + 2] = i;
    above = here;
  }
  return neighbours;
}

}  // namespace strata
