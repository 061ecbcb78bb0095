// Addresses of tiles and cells.
#ifndef STRATA_CORE_MLS_TILE_KEY_H_
#define STRATA_CORE_MLS_TILE_KEY_H_

#include <compare>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace strata {

// A tile has kTileCells × kTileCells cells.
inline constexpr int kTileCells = 256;
inline constexpr int kTileShift = 8;
// Levels of detail 0 (finest) to kMaxLevel; a cell of level l is cell_size · 2^l wide.
inline constexpr int kMaxLevel = 12;

// Cells of a map lie in [-kMaxCellIndex, kMaxCellIndex): neighbours and tile corners never
// overflow.
inline constexpr std::int32_t kMaxCellIndex = 1 << 30;

// Tile (x, y) of level l covers the half-open square [x, x+1) × [y, y+1) · kTileCells · cell_size ·
// 2^l, any sign.
struct TileKey {
  std::int32_t level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;

  friend auto operator<=>(const TileKey&, const TileKey&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const TileKey& key) {
    return H::combine(std::move(h), key.level, key.x, key.y);
  }
  std::string ToString() const { return absl::StrCat(level, "/", x, "/", y); }
};

// Cell (x, y) of a map: the half-open square [x, x+1) × [y, y+1) · cell_size.
struct CellIndex {
  std::int32_t x = 0;
  std::int32_t y = 0;
  friend auto operator<=>(const CellIndex&, const CellIndex&) = default;
};

inline TileKey TileOfCell(CellIndex cell, std::int32_t level = 0) {
  return {level, cell.x >> kTileShift, cell.y >> kTileShift};  // arithmetic shift: floors
}
// Row-major index of a cell within its tile: y · kTileCells + x.
inline std::uint16_t CellInTile(CellIndex cell) {
  return static_cast<std::uint16_t>(((cell.y & (kTileCells - 1)) << kTileShift) |
                                    (cell.x & (kTileCells - 1)));
}
inline CellIndex CellOf(const TileKey& tile, std::uint16_t cell_in_tile) {
  return {(tile.x << kTileShift) + (cell_in_tile & (kTileCells - 1)),
          (tile.y << kTileShift) + (cell_in_tile >> kTileShift)};
}

}  // namespace strata

#endif  // STRATA_CORE_MLS_TILE_KEY_H_
