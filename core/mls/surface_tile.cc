#include "core/mls/surface_tile.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"

namespace strata {
namespace {

// `votes` are those of one patch.
void Elect(std::span<const ClassVotes> votes, Surface& surface) {
  std::uint64_t all = 0;
  std::uint64_t most = 0;
  for (const ClassVotes& vote : votes) {
    if (vote.class_id > std::numeric_limits<std::uint8_t>::max()) continue;
    all += vote.count;
    if (vote.count <= most) continue;
    most = vote.count;
    surface.class_id = static_cast<std::uint8_t>(vote.class_id);
  }
  if (most == 0) return;
  const std::uint64_t percent = (200 * most + all) / (2 * all);
  surface.confidence = static_cast<std::uint8_t>(std::max<std::uint64_t>(percent, 1));
}

}  // namespace

Colour MeanColour(const ColourSum& sum) {
  if (sum.count == 0) return {};
  const auto mean = [&sum](std::uint64_t channel) {
    return static_cast<std::uint8_t>((2 * channel + sum.count) / (2 * sum.count));
  };
  return Known({.r = mean(sum.r), .g = mean(sum.g), .b = mean(sum.b)});
}

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
                               .traversability = patch.underside() ? Traversability::kUnderside
                                                                   : Traversability::kUnknown,
                               .z_m = static_cast<float>(patch.mean_m()),
                               .sigma_m = static_cast<float>(patch.sigma_m()),
                               .depth_m = static_cast<float>(patch.depth_m())});
  }
  for (std::size_t i = 0; i < tile.colour.size(); ++i) {
    result.surfaces[i].colour = MeanColour(tile.colour[i]);
  }
  for (auto vote = tile.votes.begin(); vote != tile.votes.end();) {
    const auto of_other = std::find_if(
        vote, tile.votes.end(), [&](const ClassVotes& v) { return v.patch != vote->patch; });
    Elect({vote, of_other}, result.surfaces[vote->patch]);
    vote = of_other;
  }
  return result;
}

}  // namespace strata
