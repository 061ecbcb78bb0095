// Where a robot should look next (thesis 4.4.2), on all levels that it reaches.
#ifndef STRATA_CORE_PLANNING_VIEWPOINTS_H_
#define STRATA_CORE_PLANNING_VIEWPOINTS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/occupancy/occupancy_voxels.h"
#include "core/planning/search_space.h"
#include "core/world/exploration.h"

namespace strata {

// What is known of a region.
struct SeenSpace {
  OccupancyVoxels voxels;
  std::vector<Pose> looks = {};  // T_map_sensor of each scan whose rays cross it
  std::uint64_t left_out = 0;    // that may, but whose points are gone or damaged
};

// Of a region that has kMaxExploreVoxels at most.
using SpaceOf = absl::FunctionRef<absl::StatusOr<std::shared_ptr<const SeenSpace>>(
    const Eigen::AlignedBox3d& region, double voxel_m)>;

// Between stands that are compared [m].
inline constexpr double kStandSpacingM = 1.5;
// What is so much farther has to tell e times as much [m].
inline constexpr double kNearM = 10.0;
// Heights of one level [m].
inline constexpr double kLevelM = 0.5;
// How often ground that nobody has seen counts, for robots drive on it (ExpectedViews).
inline constexpr double kGroundWeight = 10.0;

// Stands are places to stand within the budget, no two closer than kStandSpacingM, the cheapest
// first; a sensor that does not look all around is turned in eighths. Of the `horizon` nearest
// whose utility EI - λ · cost (eq. 4.15) is worth min_bits the one is taken that tells most, less
// by a factor e every kNearM of the way (Gonzalez-Banos and Latombe, 2002), else of the next ones:
// the greatest utility itself sends a robot to and fro. Stands within kLevelM of the robot's height
// come first: to leave a level and to come back for what is left there costs the way between levels
// twice. Ground that goes on from where the robot can be, but was seen too sparsely to drive on, is
// unknown whatever its voxels say (open_ground.h). Nothing is expected of where a scan was taken
// already. Then the robot is thought to be there, and what it would see to be known. Fills all but
// epoch and elapsed_ms. The same for the same tiles, scans and query.
//   INVALID_ARGUMENT   the query; a start beyond the map's range; a region of more voxels than
//                      kMaxExploreVoxels, with a resolution that fits
//   errors of `space`, `space_of` and `stop`
absl::StatusOr<ExploreResult> ChooseViews(SearchSpace& space,
                                          const ExploreQuery& query,
                                          SpaceOf space_of,
                                          const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_VIEWPOINTS_H_
