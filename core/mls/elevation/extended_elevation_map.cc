#include "core/mls/elevation/extended_elevation_map.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/mls/traversability.h"

namespace strata {
namespace {

// What a cell is by its intervals alone (lowest first); a cell of one horizontal interval is
// traversable until it is judged beside the others' heights. `judged`: each interval's surface
// among those of all levels.
ExtendedElevationCell Analyse(std::span<const Patch> intervals,
                              std::span<const Surface> judged,
                              double clearance_m) {
  const auto of = [](const Patch& patch, ElevationClass elevation_class) {
    return ExtendedElevationCell{.cell = static_cast<std::uint16_t>(patch.cell),
                                 .elevation_class = elevation_class,
                                 .z_m = static_cast<float>(patch.mean_m()),
                                 .sigma_m = static_cast<float>(patch.sigma_m()),
                                 .depth_m = static_cast<float>(patch.depth_m())};
  };
  const auto has_room = [&](std::size_t i) {
    return i + 1 == intervals.size() ||
           intervals[i + 1].bottom_m() - intervals[i].top_m() >= clearance_m;
  };
  std::size_t lowest = 0;
  while (!has_room(lowest)) ++lowest;
  const Patch& top = intervals.back();
  if (lowest + 1 < intervals.size()) {
    for (std::size_t i = lowest; i < intervals.size(); ++i) {
      if (has_room(i) && judged[i].traversability == Traversability::kTraversable) {
        return of(intervals[i], ElevationClass::kGap);
      }
    }
    return of(intervals[lowest], ElevationClass::kNonTraversable);
  }
  if (intervals.size() == 1 && !top.vertical()) return of(top, ElevationClass::kTraversable);
  ExtendedElevationCell result = of(top, ElevationClass::kVertical);
  result.depth_m = static_cast<float>(top.mean_m() - intervals.front().bottom_m());
  return result;
}

ExtendedElevationTile AnalyseTile(const MlsTile& tile,
                                  std::span<const Surface> judged,
                                  double clearance_m) {
  ExtendedElevationTile result = {.key = tile.key, .cells = {}};
  const std::span<const Patch> patches = tile.patches;
  for (std::size_t begin = 0; begin < patches.size();) {
    std::size_t end = begin + 1;
    while (end < patches.size() && patches[end].cell == patches[begin].cell) ++end;
    result.cells.push_back(Analyse(
        patches.subspan(begin, end - begin), judged.subspan(begin, end - begin), clearance_m));
    begin = end;
  }
  return result;
}

// One surface a cell, in the cells' order.
SurfaceTile HeightsOf(const ExtendedElevationTile& tile) {
  SurfaceTile result;
  result.key = tile.key;
  for (const ExtendedElevationCell& cell : tile.cells) {
    result.surfaces.push_back(
        {.cell = cell.cell, .z_m = cell.z_m, .sigma_m = cell.sigma_m, .depth_m = cell.depth_m});
  }
  result.IndexRows();
  return result;
}

SurfaceNeighbourhood Around(const std::map<TileKey, SurfaceTile>& tiles, const TileKey& key) {
  SurfaceNeighbourhood neighbours{};
  for (int i = 0; i < 9; ++i) {
    const auto it = tiles.find({key.level, key.x + i % 3 - 1, key.y + i / 3 - 1});
    neighbours[i] = it == tiles.end() ? nullptr : &it->second;
  }
  return neighbours;
}

}  // namespace

const ExtendedElevationCell* ExtendedElevationTile::Find(std::uint16_t cell_in_tile) const {
  const auto it = std::lower_bound(
      cells.begin(), cells.end(), cell_in_tile, [](const auto& cell, std::uint16_t wanted) {
        return cell.cell < wanted;
      });
  return it != cells.end() && it->cell == cell_in_tile ? &*it : nullptr;
}

const ExtendedElevationCell* ExtendedElevationMap::Find(CellIndex cell) const {
  if (tiles.empty()) return nullptr;
  const TileKey key = TileOfCell(cell, tiles.front().key.level);
  const auto it = std::lower_bound(
      tiles.begin(), tiles.end(), key, [](const auto& tile, const TileKey& wanted) {
        return tile.key < wanted;
      });
  return it != tiles.end() && it->key == key ? it->Find(CellInTile(cell)) : nullptr;
}

ExtendedElevationMap MakeExtendedElevationMap(const MlsMap& map,
                                              const TraversabilityLimits& limits) {
  const double cell_size_m = map.parameters.cell_size_m;
  std::map<TileKey, SurfaceTile> levels;
  for (const MlsTile& tile : map.tiles) levels.emplace(tile.key, SurfacesOf(tile));
  ExtendedElevationMap result;
  std::map<TileKey, SurfaceTile> heights;
  for (const MlsTile& tile : map.tiles) {
    SurfaceTile& judged = levels.at(tile.key);
    AnnotateTraversability(judged, Around(levels, tile.key), cell_size_m, limits);
    result.tiles.push_back(AnalyseTile(tile, judged.surfaces, limits.clearance_m));
    heights.emplace(tile.key, HeightsOf(result.tiles.back()));
  }
  for (ExtendedElevationTile& tile : result.tiles) {
    const std::vector<SurfaceAssessment> assessments =
        AssessSurfaces(heights.at(tile.key), Around(heights, tile.key), cell_size_m, limits);
    for (std::size_t i = 0; i < tile.cells.size(); ++i) {
      const bool planar = assessments[i].traversability == Traversability::kTraversable;
      ElevationClass& of = tile.cells[i].elevation_class;
      if (of == ElevationClass::kTraversable && !planar) of = ElevationClass::kNonTraversable;
    }
  }
  return result;
}

}  // namespace strata
