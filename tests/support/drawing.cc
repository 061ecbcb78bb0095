#include "tests/support/drawing.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata::testing {

std::vector<SurfaceTile> DrawnMap::Tiles(std::uint64_t version) const {
  std::map<TileKey, SurfaceTile> tiles;
  for (const auto& [cell, column] : columns_) {
    SurfaceTile& tile = tiles[TileOfCell(cell)];
    for (const DrawnSurface& drawn : column) {
      tile.surfaces.push_back({.cell = CellInTile(cell),
                               .traversability = drawn.underside ? Traversability::kUnderside
                                                                 : Traversability::kUnknown,
                               .z_m = static_cast<float>(drawn.z_m),
                               .sigma_m = static_cast<float>(drawn.sigma_m),
                               .depth_m = static_cast<float>(drawn.depth_m)});
    }
  }
  std::vector<SurfaceTile> result;
  for (auto& [key, tile] : tiles) {
    tile.key = key;
    tile.version = version;
    std::sort(tile.surfaces.begin(), tile.surfaces.end(), [](const Surface& a, const Surface& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.z_m < b.z_m;
    });
    tile.IndexRows();
    result.push_back(tile);
  }
  return result;
}

DrawnMap MapFromDrawing(absl::string_view rows,
                        const Legend& legend,
                        int scale,
                        CellIndex lower_left) {
  const std::vector<std::string> lines = absl::StrSplit(rows, '\n', absl::SkipWhitespace());
  DrawnMap map;
  for (std::size_t line = 0; line < lines.size(); ++line) {
    for (std::size_t column = 0; column < lines[line].size(); ++column) {
      const auto found = legend.find(lines[line][column]);
      if (found == legend.end()) continue;
      const int x0 = lower_left.x + static_cast<int>(column) * scale;
      const int y0 = lower_left.y + static_cast<int>(lines.size() - 1 - line) * scale;
      for (int i = 0; i < scale * scale; ++i) {
        map[{x0 + i % scale, y0 + i / scale}] = found->second;
      }
    }
  }
  return map;
}

}  // namespace strata::testing
