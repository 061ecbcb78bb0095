// The pyramid of levels of detail: a tile of level l + 1 out of its four children of level l. For
// far views and pictures, never for planning.
#ifndef STRATA_CORE_MLS_OVERVIEW_H_
#define STRATA_CORE_MLS_OVERVIEW_H_

#include <array>
#include <cstddef>

#include "core/mls/mls_parameters.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {

// Highest surfaces of each cell that are left of an overview that would have more in all than a
// tile may.
inline constexpr std::size_t kOverviewLayers = 64;
inline constexpr std::size_t kMaxOverviewSurfaces = kOverviewLayers * kTileCells * kTileCells;

// The tile that `key` is a quarter of. REQUIRES: key.level < kMaxLevel.
TileKey ParentOf(const TileKey& key);
// Quarter `index` = (y & 1) · 2 + (x & 1) of a tile: 0 = (low x, low y), 1 = (high x, low y),
// 2 = (low x, high y), 3 = (high x, high y). REQUIRES: parent.level > 0.
TileKey ChildOf(const TileKey& parent, int index);

// The overview of `children`, in the order of ChildOf; nullptr where the map has nothing. Children
// need surfaces sorted and rows indexed. A pure function of their surfaces; version is 0.
//
// A parent cell takes the surfaces of its 2 × 2 child cells and chains them in height: tops closer
// than γ, or than half the width of a child cell (slopes), are one surface. A chain that holds two
// surfaces of one child cell is cut at its largest gap until none does: levels that were apart in a
// cell stay apart at every level above. Of the surfaces of one chain the parent has
//   z          the mean weighted by 1/σ² (eq. 6.1)
//   σ          √(1/Σ1/σ² + weighted variance of the heights around z), so that it says how far the
//              cell's ground may be from z
//   depth      if at least half of them are vertical: z less their lowest underside, when that is
//              more than τ; otherwise 0
//   class      that of most among those that have one, the smaller id on a tie
//   traversability  that of most, the worse on a tie; unknown only if none is known
//   cost       the plain mean
// Beyond kMaxOverviewSurfaces each cell keeps its kOverviewLayers highest.
SurfaceTile MakeOverviewTile(const TileKey& parent,
                             const std::array<const SurfaceTile*, 4>& children,
                             const MlsParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_MLS_OVERVIEW_H_
