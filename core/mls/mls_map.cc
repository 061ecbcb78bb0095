#include "core/mls/mls_map.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

void MlsTile::IndexRows() {
  row_begin.fill(0);
  std::uint32_t count = 0;
  for (const Patch& patch : patches) row_begin[(patch.cell >> kTileShift) + 1] = ++count;
  // Rows without a patch end where the row before ends.
  for (int row = 0; row < kTileCells; ++row) {
    row_begin[row + 1] = std::max(row_begin[row], row_begin[row + 1]);
  }
}

std::span<const Patch> MlsTile::Cell(std::uint16_t cell_in_tile) const {
  const int row = cell_in_tile >> kTileShift;
  const auto begin = patches.begin() + row_begin[row];
  const auto end = patches.begin() + row_begin[row + 1];
  const auto first = std::lower_bound(
      begin, end, cell_in_tile, [](const Patch& p, std::uint16_t cell) { return p.cell < cell; });
  auto last = first;
  while (last != end && last->cell == cell_in_tile) ++last;
  return {first, last};
}

const MlsTile* MlsMap::Find(const TileKey& key) const {
  const auto it =
      std::lower_bound(tiles.begin(), tiles.end(), key, [](const MlsTile& tile, const TileKey& k) {
        return tile.key < k;
      });
  return it != tiles.end() && it->key == key ? &*it : nullptr;
}

std::span<const Patch> MlsMap::Cell(CellIndex cell) const {
  const MlsTile* tile = Find(TileOfCell(cell, tiles.empty() ? 0 : tiles.front().key.level));
  return tile == nullptr ? std::span<const Patch>() : tile->Cell(CellInTile(cell));
}

std::size_t MlsMap::patch_count() const {
  std::size_t count = 0;
  for (const MlsTile& tile : tiles) count += tile.patches.size();
  return count;
}

std::size_t MlsMap::occupied_cell_count() const {
  std::size_t count = 0;
  for (const MlsTile& tile : tiles) {
    for (std::size_t i = 0; i < tile.patches.size(); ++i) {
      count += i == 0 || tile.patches[i].cell != tile.patches[i - 1].cell;
    }
  }
  return count;
}

std::size_t MlsMap::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + tiles.capacity() * sizeof(MlsTile);
  for (const MlsTile& tile : tiles) {
    bytes += tile.patches.capacity() * sizeof(Patch) + tile.colour.capacity() * sizeof(ColourSum) +
             tile.votes.capacity() * sizeof(ClassVotes);
  }
  return bytes;
}

}  // namespace strata
