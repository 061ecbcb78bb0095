// A floor as a grid: where a robot can be, what stands on it, and what nobody has seen.
#ifndef STRATA_CORE_PLANNING_FLOORS_FLOOR_GRID_H_
#define STRATA_CORE_PLANNING_FLOORS_FLOOR_GRID_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/planning/floors/pieces.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_source.h"
#include "core/world/floor.h"

namespace strata {

// Blocks, by (y, x), of the floor that consists of the pieces numbered in `floor`, rising. A cell
// that is not free is compared to the nearest free one within the robot's radius and two cells:
// occupied where a surface of it stands higher than a step above that, and lower than the robot is
// high; ground where one is within a step of it.
absl::StatusOr<std::vector<FloorBlock>> FloorGrid(SearchSpace& space,
                                                  const std::vector<TileKey>& tiles,
                                                  const Pieces& pieces,
                                                  const std::vector<std::uint32_t>& floor,
                                                  const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_FLOORS_FLOOR_GRID_H_
