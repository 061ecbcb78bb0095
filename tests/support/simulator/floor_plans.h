// Storeys drawn at random, as a robot's floor grid would have them, with what every cell is.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_FLOOR_PLANS_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_FLOOR_PLANS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/world/floor.h"
#include "core/world/place.h"

namespace strata::testing {

struct DrawnFloor {
  double cell_size_m = 0.0;
  std::vector<FloorBlock> blocks;                                    // by (y, x)
  std::map<std::pair<std::int32_t, std::int32_t>, PlaceKind> kinds;  // of the free cells, by (x, y)

  std::optional<PlaceKind> KindAt(std::int32_t x, std::int32_t y) const;
};

// One storey, turned anyhow: a corridor with rooms on both sides, side corridors and maybe a
// corridor across its end; doorways of 0.8 to 1.4 m in walls of 0.1 to 0.3 m, some in the corridor
// itself and some between rooms; furniture, people's legs, worn walls. A doorway reaches 0.2 m to
// either side of its wall. Cells are free where nothing stands within the robot's radius, of 0.2 to
// 0.35 m. The same for the same seed.
DrawnFloor DrawFloor(double cell_size_m, std::uint64_t seed);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_FLOOR_PLANS_H_
