// A storey of a building in plan: walls cut at a height, and the floor below.
#ifndef STRATA_CLIENT_CLI_PLANES_STOREY_PLAN_H_
#define STRATA_CLIENT_CLI_PLANES_STOREY_PLAN_H_

#include <array>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "client/formats/grid_writer.h"
#include "core/world/plane_model.h"

namespace strata::cli {

// Floors whose height is so near to the storey's are of it [m].
inline constexpr double kStoreyReachM = 0.5;

struct StoreyOptions {
  double storey_z_m = 0.0;                                   // height of its floor, map frame
  double cut_height_m = 1.2;                                 // above that; in (0, 100]
  std::optional<Eigen::AlignedBox2d> region = std::nullopt;  // only this part, map frame [m]
};

using PlanSegment = std::array<Eigen::Vector2d, 2>;

// x and y of the map [m].
struct StoreyPlan {
  double storey_z_m = 0.0;
  double cut_z_m = 0.0;
  // Nothing is beyond; by default none of what a map may have.
  Eigen::AlignedBox2d region{Eigen::Vector2d::Constant(-1e8), Eigen::Vector2d::Constant(1e8)};
  // Where walls and sloped planes are cut, along each: nothing where it ends, and where a hole was
  // seen open, as in a door.
  std::vector<PlanSegment> walls;
  std::vector<PlanSegment> unseen;  // across holes of which nothing is known
  // What floors within 0.5 m of the storey's height cover: borders counterclockwise, holes
  // clockwise.
  std::vector<std::vector<Eigen::Vector2d>> floors;
  std::vector<Eigen::AlignedBox2d> obstacles;  // as added
};

// INVALID_ARGUMENT for options out of range and for a model that CheckPlaneModel does not take.
// NOT_FOUND where there is neither wall nor floor, naming heights at which there are floors, or
// where the storey is if the region has none of it.
absl::StatusOr<StoreyPlan> PlanOfStorey(const PlaneModel& model, const StoreyOptions& options);

// Its occupied cells within the region, those side by side along x as one.
void AddObstacles(const OccupancyGrid& grid, StoreyPlan& plan);

// Around all of it; empty where there is nothing.
Eigen::AlignedBox2d ExtentOf(const StoreyPlan& plan);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLANES_STOREY_PLAN_H_
