// Where a planner gets its tiles from.
#ifndef STRATA_CORE_PLANNING_TILE_SOURCE_H_
#define STRATA_CORE_PLANNING_TILE_SOURCE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {

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
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_TILE_SOURCE_H_
