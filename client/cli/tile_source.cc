#include "client/cli/tile_source.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<std::vector<SurfaceTile>> FetchTiles(Context& context,
                                                    const std::string& map,
                                                    std::int32_t level) {
  std::vector<SurfaceTile> tiles;
  api::TileArea area;
  area.level = level;
  STRATA_RETURN_IF_ERROR(context.database.tiles().Fetch(
      context.call, map, area, {}, [&](const api::TileUpdate& update) -> absl::Status {
        auto tile = DecodeSurfaceTile(update.tile.bytes);
        if (!tile.ok()) {
          return Annotate(tile.status(), "tile " + update.tile.key.ToString());
        }
        tiles.push_back(*std::move(tile));
        return absl::OkStatus();
      }));
  std::sort(tiles.begin(), tiles.end(), [](const SurfaceTile& a, const SurfaceTile& b) {
    return a.key < b.key;
  });
  return tiles;
}

}  // namespace strata::cli
