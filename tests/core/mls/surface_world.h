// Worlds drawn by a function of the cell, as surface tiles.
#ifndef STRATA_TESTS_CORE_MLS_SURFACE_WORLD_H_
#define STRATA_TESTS_CORE_MLS_SURFACE_WORLD_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/mls/traversability.h"

namespace strata::testing {

struct Level {
  double z_m = 0.0;
  double depth_m = 0.0;
  double sigma_m = 0.002;
  bool underside = false;
};

// The levels of a cell, in any order.
using Drawing = std::function<std::vector<Level>(CellIndex)>;

// Tiles by key.
using SurfaceWorld = std::map<TileKey, SurfaceTile>;

// The cells x_min ≤ x < x_max, y_min ≤ y < y_max of a drawing.
inline SurfaceWorld Draw(const Drawing& drawing, int x_min, int x_max, int y_min, int y_max) {
  SurfaceWorld world;
  for (int y = y_min; y < y_max; ++y) {
    for (int x = x_min; x < x_max; ++x) {
      std::vector<Level> levels = drawing({x, y});
      std::sort(levels.begin(), levels.end(), [](const Level& a, const Level& b) {
        return a.z_m < b.z_m;
      });
      if (levels.empty()) continue;
      SurfaceTile& tile = world[TileOfCell({x, y})];
      for (const Level& level : levels) {
        tile.surfaces.push_back({.cell = CellInTile({x, y}),
                                 .traversability = level.underside ? Traversability::kUnderside
                                                                   : Traversability::kUnknown,
                                 .z_m = static_cast<float>(level.z_m),
                                 .sigma_m = static_cast<float>(level.sigma_m),
                                 .depth_m = static_cast<float>(level.depth_m)});
      }
    }
  }
  for (auto& [key, tile] : world) {
    tile.key = key;
    std::stable_sort(tile.surfaces.begin(), tile.surfaces.end(), [](const auto& a, const auto& b) {
      return a.cell < b.cell;
    });
    tile.IndexRows();
  }
  return world;
}

inline const SurfaceTile* FindTile(const SurfaceWorld& world, const TileKey& key) {
  const auto it = world.find(key);
  return it == world.end() ? nullptr : &it->second;
}

inline SurfaceNeighbourhood NeighboursOf(const SurfaceWorld& world, const TileKey& key) {
  SurfaceNeighbourhood neighbours{};
  for (int i = 0; i < 9; ++i) {
    neighbours[i] = FindTile(world, {key.level, key.x + i % 3 - 1, key.y + i / 3 - 1});
  }
  return neighbours;
}

inline const Surface& SurfaceAt(const SurfaceWorld& world, CellIndex cell, std::size_t level = 0) {
  return world.at(TileOfCell(cell)).Cell(CellInTile(cell))[level];
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_MLS_SURFACE_WORLD_H_
