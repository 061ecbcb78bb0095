// A robot profile in terms of cells: what one profile's checks need over and over.
#ifndef STRATA_CORE_PLANNING_GROUND_PROFILE_CHECKS_H_
#define STRATA_CORE_PLANNING_GROUND_PROFILE_CHECKS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/planning/ground/ground_fit.h"
#include "core/world/robot_profile.h"

namespace strata {

// Heights are compared to this [m]: a step of exactly max_step_m is still taken.
inline constexpr float kHeightTolerance = 1e-4F;
// Obstacles farther than this from the footprint's edge are no danger [m].
inline constexpr double kDangerReachM = 0.5;

// A cell that a disc around another cell's centre may overlap.
struct DiscCell {
  std::int16_t dx = 0;
  std::int16_t dy = 0;
  float distance_m = 0.0F;  // from the disc's centre to the nearest point of the cell's square
  // How much ground at this cell may differ in height from the disc's centre:
  // max_step + tan(max_slope) · (distance of the centres + one cell).
  float level_m = 0.0F;
};

struct ProfileChecks {
  RobotProfile profile;
  double cell_size_m = 0.0;
  float step_m = 0.0F;  // with tolerance, as height and slope below
  float height_m = 0.0F;
  float slope_tan = 0.0F;
  float roughness_m = 0.0F;
  // √(radius² + (half a cell's diagonal)²): discs of this size at the two ends of a move to a
  // neighbouring cell cover everything that the robot's disc sweeps between them.
  float footprint_m = 0.0F;
  float reach_m = 0.0F;          // footprint_m + kDangerReachM; distances are cut off here
  std::vector<DiscCell> disc;    // all within reach_m, nearest first
  int disc_cells = 0;            // largest |dx|
  int gap_cells[2] = {0, 0};     // longest gap along an axis, along a diagonal
  int behind_cells[2] = {0, 0};  // how far behind a hole obstacles and drops count: the footprint
  int sight_cells = 0;           // how far from a surface its edges and their reasons reach
  int margin = 0;                // of the GroundWindow that the checks of a tile need

  int GapCells(int direction) const { return gap_cells[direction & 1]; }
  int BehindCells(int direction) const { return behind_cells[direction & 1]; }
  double StepLength(int direction) const {
    return (direction & 1) != 0 ? cell_size_m * 1.4142135623730951 : cell_size_m;
  }
  // Height that may lie between the two rims of a move over `length_m`.
  float RiseOver(double length_m) const;
  // ≥ 0: the danger of traversability.h from slope, roughness and σ (steps are moves' own), and
  //   2 · (1 − (distance − footprint) / kDangerReachM)²
  // where `distance_m` in [footprint_m, reach_m] is that to the nearest obstacle, drop or unknown
  // ground.
  double Danger(const GroundFit& fit, float sigma_m, float distance_m) const;
};

// INVALID_ARGUMENT for a profile out of range or one that spans more cells than a tile has
// (3 · radius + kDangerReachM + 2 · max_gap may not exceed about 240 cells).
absl::StatusOr<ProfileChecks> MakeProfileChecks(const RobotProfile& profile, double cell_size_m);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_PROFILE_CHECKS_H_
