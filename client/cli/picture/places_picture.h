// The places of a floor as a picture: rooms blue, corridors yellow, doorways red; what stands there
// is black, and ground where no robot can be is grey.
#ifndef STRATA_CLIENT_CLI_PICTURE_PLACES_PICTURE_H_
#define STRATA_CLIENT_CLI_PICTURE_PLACES_PICTURE_H_

#include "client/cli/picture/image.h"
#include "core/world/floor.h"
#include "core/world/place.h"

namespace strata::picture {

inline constexpr Colour kRoomColour = {104, 152, 222};
inline constexpr Colour kCorridorColour = {250, 209, 84};
inline constexpr Colour kDoorwayColour = {222, 62, 50};

// x to the right, y up; as many pixels a cell as fit 1600 × 1100, or cells a pixel. Every room and
// corridor has its number on it, and the legend is below. `floor` and `places` have their blocks.
Image DrawPlaces(const FloorPlaces& places, const Floor& floor);

}  // namespace strata::picture

#endif  // STRATA_CLIENT_CLI_PICTURE_PLACES_PICTURE_H_
