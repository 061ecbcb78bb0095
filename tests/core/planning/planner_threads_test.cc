// One planner and its cache, asked by several threads at once; tiles prepared by several threads.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/planning/planner.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::MapFromDrawing;
using ::strata::testing::MemoryTiles;

// Bands side by side, a thread each.
absl::Status InThreads(std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body) {
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < count; ++i) {
    threads.emplace_back([&body, i] { STRATA_EXPECT_OK(body(i)); });
  }
  return absl::OkStatus();
}

TEST(PlannerThreadsTest, ATileIsTheSameByAnyLoop) {
  const std::uint64_t seed = 20261123;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  for (int world = 0; world < 3; ++world) {
    std::string drawing;
    for (int i = 0; i < 60 * 60; ++i) {
      if (i > 0 && i % 60 == 0) drawing += '\n';
      drawing += "......#= "[random() % 9];
    }
    MemoryTiles source(
        MapFromDrawing(
            drawing, {{'.', {{0.0}}}, {'#', {{0.7, 0.7}}}, {'=', {{0.0}, {1.5, 0.2}}}}, 5)
            .Tiles());
    STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks,
                                MakeProfileChecks({.radius_m = 0.15, .max_gap_m = 0.6}, 0.1));
    for (const TileKey& key : source.Keys()) {
      STRATA_ASSERT_OK_AND_ASSIGN(const TileNeighbourhood tiles, LoadAround(source, key));
      const GroundWindow window(tiles, checks.margin, 0.1);
      const PreparedTile tile = PrepareTile(*tiles[kMiddleTile], window, checks);
      EXPECT_FALSE(tile.far_moves.empty());
      EXPECT_EQ(PrepareTile(*tiles[kMiddleTile], window, checks, InThreads), tile)
          << key.ToString();
    }
  }
}

TEST(PlannerThreadsTest, ALoopWithoutMemoryIsAnAllocationThatFailed) {
  const ParallelLoop none = [](std::size_t, absl::FunctionRef<absl::Status(std::size_t)>) {
    return absl::ResourceExhaustedError("no memory");
  };
  EXPECT_THROW(ForRows(none, 0, 10, [](int, int) {}), std::bad_alloc);
}

TEST(PlannerThreadsTest, WhoIsToldToStopIsGivenNoTile) {
  MemoryTiles source(MapFromDrawing("....\n....", {{'.', {{0.0}}}}, 5).Tiles());
  STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks({}, 0.1));
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 24));
  const Stop stop;
  SearchSpace space(cache, source, checks, {}, stop);
  stop.Request();
  EXPECT_EQ(space.SlotOf(source.Keys().front()), -1);
  EXPECT_EQ(space.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(source.loads, 0);
}

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
