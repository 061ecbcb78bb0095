// From which side a scan saw its surfaces. The top of a deck and its underside are two things: one
// is not matched to the other, and nobody drives on what was seen from below only.
#ifndef STRATA_CORE_MLS_SIDES_H_
#define STRATA_CORE_MLS_SIDES_H_

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "core/mls/mls_map.h"

namespace strata {

enum class Side : std::uint8_t {
  kUnknown,    // nothing says which
  kTop,        // seen from above
  kUnderside,  // seen from below
  kDoubtful,   // too few points to tell, as high as undersides that the scan saw
};

// The side of every patch, tile by tile, of the map of one scan that was taken from `p_sensor`, in
// the map's frame [m], of which the unit vector `up` is the vertical: a scan taken on a ramp has
// its own. What is not above the sensor is seen from above. Of the horizontal patches above it the
// planes of cubes of 1 m are judged: those that are level (within 26°) and face the sensor from
// above it are undersides, all that spans a surface of another kind, or none, is a top. Lines and
// what is sparse are judged in cubes of 2 m, then 4 m, with four points a metre of edge at least.
// What lies horizontally farther than `max_range_m` from the map's origin is left out: kUnknown.
// A pure function of its arguments.
std::vector<Side> SidesOf(const MlsMap& map,
                          const Eigen::Vector3d& p_sensor,
                          double max_range_m = std::numeric_limits<double>::infinity(),
                          const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

// Sets Patch::sides to what SidesOf() says, but for seen from below only of what the sensor looked
// up to by more than 3° and under which, within 1 to 2 m around, something lies 1.5 m lower or
// more; what is doubtful is taken for seen from below there. Where there seem to be undersides and
// the ground is not below the sensor nothing is set: a merged cloud, with its origin anywhere, says
// nothing of sides. Joining marked maps joins their sides, so whatever is seen from above once is
// ground to be judged.
void MarkSides(const Eigen::Vector3d& p_sensor, MlsMap& map);

}  // namespace strata

#endif  // STRATA_CORE_MLS_SIDES_H_
