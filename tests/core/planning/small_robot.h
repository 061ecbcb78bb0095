// A small robot asked to plan in drawn worlds.
#ifndef STRATA_TESTS_CORE_PLANNING_SMALL_ROBOT_H_
#define STRATA_TESTS_CORE_PLANNING_SMALL_ROBOT_H_

#include <utility>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/planning/planner.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

inline constexpr double kCell = 0.1;

// Small enough for drawings in half metres.
inline RobotProfile SmallRobot() {
  return {.radius_m = 0.2, .height_m = 1.0, .max_step_m = 0.15, .max_slope_rad = 0.35};
}

inline PlanEndpoint At(double x, double y, double z) { return {.x_m = x, .y_m = y, .z_m = z}; }

inline PlanResult PlanIn(const DrawnMap& map, const PlanQuery& query) {
  MemoryTiles source(map.Tiles());
  Planner planner({.cell_size_m = kCell});
  absl::StatusOr<PlanResult> result = planner.Plan(source, query, Stop());
  STRATA_EXPECT_OK(result);
  return result.ok() ? *std::move(result) : PlanResult();
}

inline PlanResult PlanIn(const DrawnMap& map, const PlanEndpoint& from, const PlanEndpoint& to) {
  return PlanIn(map, {.from = from, .to = to, .profile = SmallRobot()});
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_PLANNING_SMALL_ROBOT_H_
