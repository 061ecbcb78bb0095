#include "core/mls/elevation/extended_elevation_map.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/mls/traversability.h"

namespace strata {
namespace {

// What a cell is by its intervals alone (lowest first), each judged among those of all levels; a
// cell of one horizontal interval is traversable until it is judged beside the others' heights.
ExtendedElevationCell Analyse(std::span<const Surface> intervals, double clearance_m) {
  const auto of = [](const Surface& surface, ElevationClass elevation_class) {
    return ExtendedElevationCell{.cell = surface.cell,
                                 .elevation_class = elevation_class,
                                 .z_m = surface.z_m,
                                 .sigma_m = surface.sigma_m,
                                 .depth_m = surface.depth_m};
  };
  const auto has_room = [&](std::size_t i) {
    return i + 1 == intervals.size() ||
           intervals[i + 1].bottom_m() - intervals[i].z_m >= clearance_m;
  };
  std::size_t lowest = 0;
  while (!has_room(lowest)) ++lowest;
  const Surface& top = intervals.back();
  if (lowest + 1 < intervals.size()) {
    for (std::size_t i = lowest; i < intervals.size(); ++i) {
      if (has_room(i) && intervals[i].traversability == Traversability::kTraversable) {
        return of(intervals[i], ElevationClass::kGap);
      }
    }
    return of(intervals[lowest], ElevationClass::kNonTraversable);
  }
  if (intervals.size() == 1 && !top.vertical()) {
    return of(top,
              top.underside() ? ElevationClass::kNonTraversable : ElevationClass::kTraversable);
  }
  ExtendedElevationCell result = of(top, ElevationClass::kVertical);
  result.depth_m = top.z_m - intervals.front().bottom_m();
  return result;
}

// A tile's cells, and their heights as surfaces, one a cell.
struct AnalysedTile {
  ExtendedElevationTile tile;
  SurfaceTile heights;
};

AnalysedTile AnalyseTile(const SurfaceTile& judged, double clearance_m) {
  AnalysedTile result;
  result.tile.key = result.heights.key = judged.key;
  const std::span<const Surface> surfaces = judged.surfaces;
  for (std::size_t begin = 0, end = 0; begin < surfaces.size(); begin = end) {
    while (end < surfaces.size() && surfaces[end].cell == surfaces[begin].cell) ++end;
    const ExtendedElevationCell cell = Analyse(surfaces.subspan(begin, end - begin), clearance_m);
    result.tile.cells.push_back(cell);
    const bool underside = end == begin + 1 && surfaces[begin].underside();
    result.heights.surfaces.push_back(
        {.cell = cell.cell,
         .traversability = underside ? Traversability::kUnderside : Traversability::kUnknown,
         .z_m = cell.z_m,
         .sigma_m = cell.sigma_m,
         .depth_m = cell.depth_m});
  }
  result.heights.IndexRows();
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

absl::StatusOr<ExtendedElevationMap> MakeExtendedElevationMap(std::vector<SurfaceTile> tiles,
                                                              double cell_size_m,
                                                              const TraversabilityLimits& limits,
                                                              const Stop& stop) {
  std::map<TileKey, SurfaceTile> levels;
  for (SurfaceTile& tile : tiles) levels.emplace(tile.key, std::move(tile));
  ExtendedElevationMap result;
  std::map<TileKey, SurfaceTile> heights;
  for (auto& [key, judged] : levels) {
    STRATA_RETURN_IF_ERROR(stop.status());
    AnnotateTraversability(judged, Around(levels, key), cell_size_m, limits);
    AnalysedTile analysed = AnalyseTile(judged, limits.clearance_m);
    result.tiles.push_back(std::move(analysed.tile));
    heights.emplace(key, std::move(analysed.heights));
  }
  for (ExtendedElevationTile& tile : result.tiles) {
    STRATA_RETURN_IF_ERROR(stop.status());
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

absl::StatusOr<ElevationMap> ElevationOf(const ExtendedElevationMap& map,
                                         double cell_size_m,
                                         const ElevationRegion& region) {
  std::vector<CellIndex> indices;
  std::vector<ElevationCell> cells;
  for (const ExtendedElevationTile& tile : map.tiles) {
    for (const ExtendedElevationCell& cell : tile.cells) {
      const CellIndex index = CellOf(tile.key, cell.cell);
      if (!IsInside(index, cell_size_m, region)) continue;
      indices.push_back(index);
      cells.push_back({.z_m = cell.z_m, .sigma_m = cell.sigma_m});
    }
  }
  STRATA_ASSIGN_OR_RETURN(ElevationMap result, RectangleAround(indices, cell_size_m));
  for (std::size_t i = 0; i < indices.size(); ++i) result.CellAt(indices[i]) = cells[i];
  return result;
}

}  // namespace strata
