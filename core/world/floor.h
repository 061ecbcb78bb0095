// Floors: what of a map one robot can drive in one go without ever being above itself.
#ifndef STRATA_CORE_WORLD_FLOOR_H_
#define STRATA_CORE_WORLD_FLOOR_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata {

// A floor's cells lie in blocks of kFloorBlockCells × kFloorBlockCells.
inline constexpr int kFloorBlockCells = 8;

// Block (x, y) has the cells [8 x, 8 x + 8) × [8 y, 8 y + 8) of the map. Cell (i, j) of it, counted
// along x and y from its lower left, is bit 8 j + i; a cell is in one of the masks at most, and
// nothing was seen at the height of the floor where it is in none.
struct FloorBlock {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::uint64_t free = 0;  // the robot's centre can be there
  // Something stands there that is higher than a step, or was inferred to, if that is minded.
  std::uint64_t occupied = 0;
  std::uint64_t ground = 0;  // ground on which the robot cannot stand: steep, or close to an edge

  friend bool operator==(const FloorBlock&, const FloorBlock&) = default;
};

// Places to stand, connected by moves; of each cell one at most.
struct Floor {
  double area_m2 = 0.0;                           // of the free cells
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  // box around the free cells
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  double mean_z_m = 0.0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // a place to stand, near the middle
  std::vector<FloorBlock> blocks;                   // by (y, x); only where asked for
};

// Where one drives from one floor to another: on a ramp, stairs, or wherever floors that lie above
// each other elsewhere meet.
struct FloorLink {
  int a = 0;  // numbers of floors, a < b
  int b = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // in the middle of the border
  double width_m = 0.0;                             // of the border
  double slope_rad = 0.0;                           // of the ground across it, over about a block
};

struct FloorQuery {
  RobotProfile profile;
  std::optional<PlanEndpoint> at = std::nullopt;  // whose floor is asked for
  double min_area_m2 = 10.0;                      // smaller ones are left out; finite, ≥ 0
  bool cells = false;  // fills Floor::blocks: of the floor at `at`, of number `floor`, or of all
  std::optional<int> floor = std::nullopt;  // of which the cells are told; not beside `at`
  InferredAs inferred = InferredAs::kIgnore;
};

struct FloorPlan {
  std::vector<Floor> floors;  // the largest first
  std::vector<FloorLink> links;
  std::optional<int> at;  // the floor at FloorQuery::at; none where that is on no floor
  std::string message;    // for people: what is to be known of what was inferred, else nothing
  double cell_size_m = 0.0;
  std::uint64_t epoch = 0;
  std::uint64_t commit_sequence = 0;  // the state of the map that it is about
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_FLOOR_H_
