// The tiles of a map, fetched and decoded.
#ifndef STRATA_CLIENT_CLI_TILE_SOURCE_H_
#define STRATA_CLIENT_CLI_TILE_SOURCE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/cli/command.h"
#include "core/mls/surface_tile.h"

namespace strata::cli {

// All tiles of one level of detail, by key.
absl::StatusOr<std::vector<SurfaceTile>> FetchTiles(Context& context,
                                                    const std::string& map,
                                                    std::int32_t level);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TILE_SOURCE_H_
