// Rooms, corridors and doorways of a floor (thesis 9.4.4, on multi-level surface maps).
#ifndef STRATA_CORE_CLASSIFICATION_PLACES_PLACES_H_
#define STRATA_CORE_CLASSIFICATION_PLACES_PLACES_H_

#include <span>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/world/floor.h"
#include "core/world/place.h"

namespace strata {

// Places of the floor that `blocks` are of, the largest first: every free cell is of one. Rooms and
// corridors of less than a square metre are of what is around them. `cells`: fills Place::blocks.
// A function of the blocks alone. No blocks, or nothing free: no places.
//   RESOURCE_EXHAUSTED  a box of more than kMaxPlaceBoxCells, or more than kMaxPlaceSamples
//   errors of `stop`
absl::StatusOr<std::vector<Place>> FindPlaces(std::span<const FloorBlock> blocks,
                                              double cell_size_m,
                                              bool cells,
                                              const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_PLACES_PLACES_H_
