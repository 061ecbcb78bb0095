// Where a planner gets its tiles from.
#ifndef STRATA_CORE_PLANNING_TILE_SOURCE_H_
#define STRATA_CORE_PLANNING_TILE_SOURCE_H_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/world/robot_profile.h"
#include "core/world/things/inferred_tile.h"

namespace strata {

// What one tile's preparation was made of: the versions of the tile and of its eight neighbours.
using TileVersions = std::array<std::uint64_t, 9>;
// In the version of a tile together with what was inferred in it; else it is not set.
inline constexpr std::uint64_t kWithInferred = std::uint64_t{1} << 63;

// The form of prepared tiles and of their packing. Whoever changes either raises it: what a
// map's file keeps of an earlier one is prepared again.
inline constexpr std::uint32_t kPreparationForm = 2;

// One consistent state (epoch) of a map's level-0 tiles; a query keeps to one source. A planner
// calls it from the thread of the query only.
class TileSource {
 public:
  virtual ~TileSource() = default;

  // nullptr where the map has nothing. An error ends the query with that error.
  virtual absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) = 0;
  // Content version of a tile, 0 where the map has nothing. Equal versions of a key mean equal
  // bytes, over all sources that one planner is given. Cheap: asked nine times a tile and query.
  virtual std::uint64_t Version(const TileKey& key) = 0;
  // What PackTile made of the tile when it was prepared from `versions` for `profile` before, with
  // this kPreparationForm; nullopt where it is not kept. Where it cannot be had, and on errors, the
  // tile is prepared anew.
  virtual absl::StatusOr<std::optional<std::string>> LoadPrepared(const TileKey& /*key*/,
                                                                  const TileVersions& /*versions*/,
                                                                  const RobotProfile& /*profile*/) {
    return std::optional<std::string>();
  }
  // What was inferred in the tile, for queries that keep robots out of it; nullptr: nothing. The
  // tile itself need not be there.
  virtual std::shared_ptr<const InferredTile> Inferred(const TileKey& /*key*/) { return nullptr; }
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_TILE_SOURCE_H_
