// Whether a path may be driven as it is: the rules of planner.h along given waypoints.
#ifndef STRATA_CORE_PLANNING_PATH_CHECK_H_
#define STRATA_CORE_PLANNING_PATH_CHECK_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {

// INVALID_ARGUMENT naming what is wrong: see Planner::Check.
absl::Status ValidateWaypoints(const std::vector<Eigen::Vector3d>& waypoints, double cell_size_m);

// The tiles of level 0 under the lines between the waypoints, sorted. REQUIRES: valid waypoints.
std::vector<TileKey> TilesUnder(const std::vector<Eigen::Vector3d>& waypoints, double cell_size_m);

// Walks the cells under the lines between the waypoints. It holds if
//   - every waypoint is on a surface, within max_step of its height,
//   - every cell is entered by a move of the graph, over a gap too, onto ground to stand on,
//   - where a line does not pass through the middle of a cell, the nearest edge is at least radius
//     + (the line's distance from the middle) away, as for what the planner pulls straight.
// Waypoints may be rounded to 1/200 of a cell, or 1 mm. Fills all but epoch and commit_sequence.
// REQUIRES: valid waypoints.
absl::StatusOr<PathCheck> CheckPath(SearchSpace& space,
                                    const std::vector<Eigen::Vector3d>& waypoints,
                                    const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PATH_CHECK_H_
