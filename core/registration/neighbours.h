// Which of the scans in place a new scan is matched to.
#ifndef STRATA_CORE_REGISTRATION_NEIGHBOURS_H_
#define STRATA_CORE_REGISTRATION_NEIGHBOURS_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/status.h"

#include "core/geometry/pose.h"

namespace strata {

struct NeighbourPolicy {
  // Scans whose origins are farther than this from the guess are no neighbours [m]; in (0, 1000].
  double radius_m = 25.0;
  // At most so many; in [1, 1000]. More average the noise of more scans and drift less; each costs
  // about 0.4 ms and hides less of a wrong pose among its neighbours.
  int max_scans = 15;

  absl::Status Validate() const;
};

// Indices into `T_map_scans` of the scans to match to: the nearest to the guess by origin, ties to
// the later one (the last placed agrees best with what comes next), in ascending order. Empty when
// none is within the radius. A pure function.
std::vector<std::size_t> SelectNeighbours(std::span<const Pose> T_map_scans,
                                          const Pose& T_map_source_guess,
                                          const NeighbourPolicy& policy = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_NEIGHBOURS_H_
