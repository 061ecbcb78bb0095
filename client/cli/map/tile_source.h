// The tiles of a map, fetched and decoded.
#ifndef STRATA_CLIENT_CLI_MAP_TILE_SOURCE_H_
#define STRATA_CLIENT_CLI_MAP_TILE_SOURCE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/terminal/command.h"
#include "core/api/tiles.h"
#include "core/mls/surface_tile.h"

namespace strata::cli {

struct FetchedTiles {
  std::vector<SurfaceTile> tiles;  // by key
  absl::Status damage;             // DATA_LOSS naming the tiles that cannot be read and the cure
};

// All tiles of the area that can be read.
absl::StatusOr<FetchedTiles> FetchTiles(Context& context,
                                        const std::string& map,
                                        const api::TileArea& area);

// FAILED_PRECONDITION: what to do about a map without any.
absl::Status NoSurfaces(const std::string& map);

// FAILED_PRECONDITION where there are surfaces and none of them has a colour.
absl::Status ExpectColours(const std::string& map, const std::vector<SurfaceTile>& tiles);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MAP_TILE_SOURCE_H_
