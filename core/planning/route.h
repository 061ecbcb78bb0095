// From the patches of a search to the path that a robot is given.
#ifndef STRATA_CORE_PLANNING_ROUTE_H_
#define STRATA_CORE_PLANNING_ROUTE_H_

#include <vector>

#include <Eigen/Core>

#include "core/mls/tile_key.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {

// Waypoints leave out what lies this close above or below the straight line between two others.
inline constexpr double kWaypointToleranceM = 0.05;

struct Route {
  std::vector<Eigen::Vector3d> waypoints;
  double length_m = 0.0;  // of the waypoints
  double cost_m = 0.0;    // Σ length · (1 + danger) · class factor, of the surfaces
  std::vector<PlanGap> gaps;
  std::vector<TileKey> tiles;  // sorted
};

// Pulls straight what can be: a stretch of moves becomes a line from cell centre to cell centre
// where every cell that the line crosses is entered by a move of the graph, is at least radius +
// (the line's distance from its centre) away from the nearest edge of the ground, and the line
// costs no more than the stretch. Moves over gaps stay as they are. `path` is not empty.
Route MakeRoute(SearchSpace& space, const std::vector<PatchId>& path);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_ROUTE_H_
