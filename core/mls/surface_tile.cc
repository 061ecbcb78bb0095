#include "core/mls/surface_tile.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"

namespace strata {

void SurfaceTile::IndexRows() {
  row_begin.fill(0);
  for (const Surface& surface : surfaces) ++row_begin[(surface.cell >> kTileShift) + 1];
  for (int row = 0; row < kTileCells; ++row) row_begin[row + 1] += row_begin[row];
}

std::span<const Surface> SurfaceTile::Cell(std::uint16_t cell_in_tile) const {
  const int row = cell_in_tile >> kTileShift;
  const auto begin = surfaces.begin() + row_begin[row];
  const auto end = surfaces.begin() + row_begin[row + 1];
  const auto first = std::lower_bound(
      begin, end, cell_in_tile, [](const Surface& s, std::uint16_t cell) { return s.cell < cell; });
  auto last = first;
  while (last != end && last->cell == cell_in_tile) ++last;
  return {first, last};
}

SurfaceTile SurfacesOf(const MlsTile& tile) {
  SurfaceTile result;
  result.key = tile.key;
  result.row_begin = tile.row_begin;
  result.surfaces.reserve(tile.patches.size());
  for (const Patch& patch : tile.patches) {
    result.surfaces.push_back({.cell = static_cast<std::uint16_t>(patch.cell),
                               .z_m = static_cast<float>(patch.mean_m()),
                               .sigma_m = static_cast<float>(patch.sigma_m()),
                               .depth_m = static_cast<float>(patch.depth_m())});
  }
  std::uint32_t best_count = 0;
  for (std::size_t i = 0; i < tile.votes.size(); ++i) {
    const ClassVotes& vote = tile.votes[i];
    if (i == 0 || tile.votes[i - 1].patch != vote.patch) best_count = 0;
    if (vote.count <= best_count) continue;
    best_count = vote.count;
    result.surfaces[vote.patch].class_id = static_cast<std::uint8_t>(vote.class_id);
  }
  return result;
}

}  // namespace strata
