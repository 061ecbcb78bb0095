// A yard in which every scan leaves a mark of its own in the map, so that tiles tell which scans
// they hold and where those were.
#ifndef STRATA_TESTS_INTEGRATION_MARKED_YARD_H_
#define STRATA_TESTS_INTEGRATION_MARKED_YARD_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/world/scan.h"

namespace strata::testing {

// Robots are "robot1" to "robot8", each drives a lane of its own; sequences are 1 to 60.
inline constexpr int kYardRobots = 8;
inline constexpr std::uint64_t kYardScans = 60;
ScanId YardScan(int robot, std::uint64_t sequence);

// Where a scan is taken, and what is seen: the yard, and the scan's mark, a level plate of 0.5 m
// far above it where no other scan has anything.
Pose YardTruth(const ScanId& id);
PointCloud SeeYard(const ScanId& id);

// The height of a mark [m] by the cells of level 0 of a map with default parameters.
using Mark = std::map<CellIndex, float>;
// Adds what `tile` shows of marks that are less than 1.5 m above or below their true height.
void CollectMarks(const SurfaceTile& tile, std::map<ScanId, Mark>& marks);

// Empty if `mark` is where a scan at that pose leaves it, otherwise what is wrong.
std::string Misplaced(const ScanId& id, const Pose& T_map_scan, const Mark& mark);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_MARKED_YARD_H_
