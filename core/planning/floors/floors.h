// Floors of a map for one robot.
//
// What moves connect is cut into pieces of a block of 8 × 8 cells at most (pieces.h). Pieces are
// then put together over their borders, the flattest first (Kruskal's order), by the slope between
// their middles; never two of which one has cells above or below the other's. What is left is
// single-valued and connected, and its limits lie where the ground between is steepest: on ramps
// and stairs. No height, number of floors or seed is asked for.
#ifndef STRATA_CORE_PLANNING_FLOORS_FLOORS_H_
#define STRATA_CORE_PLANNING_FLOORS_FLOORS_H_

#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"
#include "core/world/floor.h"

namespace strata {

// All but epoch and commit_sequence. `tiles` are those of the map, sorted. A function of the tiles
// and the query alone; time and memory grow with the places to stand. No tiles, or nowhere to
// stand: no floors.
//   INVALID_ARGUMENT    profile, place or least area not finite or out of range
//   RESOURCE_EXHAUSTED  more places to stand than kMaxFloorPatches
//   errors of the source and of `stop`
absl::StatusOr<FloorPlan> FindFloors(TileCache& cache,
                                     TileSource& source,
                                     const std::vector<TileKey>& tiles,
                                     double cell_size_m,
                                     const FloorQuery& query,
                                     const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_FLOORS_FLOORS_H_
