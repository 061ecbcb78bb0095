// One planner and its cache, asked by several threads at once.
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/planning/planner.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::MapFromDrawing;
using ::strata::testing::MemoryTiles;

TEST(PlannerThreadsTest, ManyThreadsGetTheSameAnswers) {
  const std::string road(28, '.');
  const std::string wall = std::string(20, '.') + "####" + std::string(4, '.');
  const DrawnMap map =
      MapFromDrawing(road + "\n" + road + "\n" + wall + "\n" + wall + "\n" + wall + "\n" + road,
                     {{'.', {{0.0}}}, {'#', {{2.0, 2.0}}}},
                     5);
  const PlanQuery query = {
      .from = {.x_m = 1.05, .y_m = 1.55, .z_m = 0.0},
      .to = {.x_m = 13.05, .y_m = 1.55, .z_m = 0.0},
      .profile = {.radius_m = 0.2, .height_m = 1.0, .max_step_m = 0.15, .max_slope_rad = 0.35}};
  Planner planner({.cell_size_m = 0.1});
  std::vector<double> costs(4, -1.0);
  std::vector<std::thread> threads;
  for (double& cost : costs) {
    threads.emplace_back([&planner, &map, &query, &cost] {
      MemoryTiles source(map.Tiles());
      for (int i = 0; i < 5; ++i) {
        const auto result = planner.Plan(source, query, Stop());
        cost = result.ok() && result->found() ? result->cost : -2.0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(costs[0], 12.0);
  for (const double cost : costs) EXPECT_DOUBLE_EQ(cost, costs[0]);
  EXPECT_LE(planner.cache_statistics().prepared, map.Tiles().size());
}

}  // namespace
}  // namespace strata
