#include "client/cli/map/tile_source.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"

namespace strata::cli {

namespace {

absl::Status DamageOf(const std::string& map, const std::vector<TileKey>& damaged) {
  if (damaged.empty()) return absl::OkStatus();
  const std::string keys = absl::StrJoin(damaged, ", ", [](std::string* text, const TileKey& key) {
    absl::StrAppend(text, key.ToString());
  });
  return absl::DataLossError(absl::StrCat(damaged.size(),
                                          damaged.size() == 1 ? " tile is" : " tiles are",
                                          " damaged and left out: ",
                                          keys,
                                          "; map rebuild ",
                                          map,
                                          damaged.size() == 1 ? " mends it" : " mends them"));
}

}  // namespace

absl::StatusOr<FetchedTiles> FetchTiles(Context& context,
                                        const std::string& map,
                                        const api::TileArea& area) {
  FetchedTiles fetched;
  std::vector<TileKey> damaged;
  STRATA_RETURN_IF_ERROR(context.database.tiles().Fetch(
      context.call, map, area, {}, [&](const api::TileUpdate& update) {
        absl::StatusOr<SurfaceTile> tile = DecodeSurfaceTile(update.tile.bytes);
        if (tile.ok() && tile->key == update.tile.key) {
          fetched.tiles.push_back(*std::move(tile));
        } else {
          damaged.push_back(update.tile.key);
        }
        return absl::OkStatus();
      }));
  std::sort(fetched.tiles.begin(),
            fetched.tiles.end(),
            [](const SurfaceTile& a, const SurfaceTile& b) { return a.key < b.key; });
  fetched.damage = DamageOf(map, damaged);
  return fetched;
}

absl::Status NoSurfaces(const std::string& map) {
  return absl::FailedPreconditionError(absl::StrCat(
      "map ", map, " has no surfaces: import scans, or wait until they are integrated"));
}

absl::Status ExpectColours(const std::string& map, const std::vector<SurfaceTile>& tiles) {
  bool empty = true;
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) {
      if (surface.coloured()) return absl::OkStatus();
      empty = false;
    }
  }
  if (empty) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "map ", map, " has no colours: its scans have none; --layer traversability draws it"));
}

}  // namespace strata::cli
