// Plans in less memory than they would like: the answers beside those with plenty.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/planning/planner.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::DrawnSurface;
using ::strata::testing::MemoryTiles;

constexpr double kCell = 0.1;
constexpr int kWidth = 560;
constexpr int kHeight = 300;

// Rolling noisy ground over twelve tiles with walls that leave narrow gaps near the borders of
// tiles, so that ways go to and fro between them, a deck with a ramp, holes and fields of classes.
std::vector<SurfaceTile> Labyrinth(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.008);
  const auto pick = [&random](int n) { return static_cast<int>(random() % n); };
  const CellIndex corner = {-130 - pick(200), -20 - pick(230)};
  std::vector<std::vector<DrawnSurface>> columns(static_cast<std::size_t>(kWidth) * kHeight);
  const auto at = [&](int x, int y) -> std::vector<DrawnSurface>& {
    return columns[static_cast<std::size_t>(y) * kWidth + x];
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      at(x, y) = {{0.4 * std::sin(x / 43.0) * std::cos(y / 37.0) + noise(random)}};
    }
  }
  for (int x = 40 + pick(30); x < kWidth - 20; x += 35 + pick(40)) {
    const int gap = pick(2) == 0 ? pick(60) : kHeight - 60 + pick(40);
    for (int y = 0; y < kHeight; ++y) {
      if (y >= gap && y < gap + 14) continue;
      for (int d = 0; d < 2; ++d) at(x + d, y) = {{2.0, 2.5}};
    }
  }
  for (int y = 100; y < 140; ++y) {
    for (int x = 200; x < 420; ++x) {
      const double z = std::min({2.6, (x - 200) * 0.03, (420 - x) * 0.03});
      if (z > 2.0) {
        at(x, y).push_back({z + noise(random), 0.2});
      } else {
        at(x, y) = {{z, 0.3}};
      }
    }
  }
  for (int k = 0; k < kWidth * kHeight / 60; ++k) at(pick(kWidth), pick(kHeight)).clear();
  DrawnMap map;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!at(x, y).empty()) map[{corner.x + x, corner.y + y}] = at(x, y);
    }
  }
  std::vector<SurfaceTile> tiles = map.Tiles();
  for (SurfaceTile& tile : tiles) {
    for (Surface& surface : tile.surfaces) {
      surface.class_id = static_cast<std::uint8_t>((surface.cell >> 12 ^ surface.cell >> 5) & 3);
    }
  }
  return tiles;
}

PlanEndpoint SomePlace(const std::vector<SurfaceTile>& tiles, std::mt19937_64& random) {
  const SurfaceTile& tile = tiles[random() % tiles.size()];
  const Surface& surface = tile.surfaces[random() % tile.surfaces.size()];
  const CellIndex cell = CellOf(tile.key, surface.cell);
  return {.x_m = (cell.x + 0.5) * kCell, .y_m = (cell.y + 0.5) * kCell, .z_m = surface.z_m};
}

std::vector<PlanQuery> Queries(const std::vector<SurfaceTile>& tiles, std::uint64_t seed, int n) {
  std::mt19937_64 random(seed);
  std::vector<PlanQuery> queries;
  for (int i = 0; i < n; ++i) {
    PlanQuery& query = queries.emplace_back();
    query.from = SomePlace(tiles, random);
    query.to = SomePlace(tiles, random);
    if (i % 3 == 1) query.class_costs = {{1, 2.5}, {2, 1.5}};
    if (i % 3 == 2) query.class_costs = {{3, kForbiddenClass}, {1, 1.25}};
    if (i % 4 == 3) query.profile.radius_m = 0.15;
  }
  return queries;
}

// One tile at hand, and a few.
constexpr std::size_t kBudgets[] = {20'000'000, 50'000'000};

TEST(PlannerMemoryTest, CostsAreWithinOnePercentAndRefusalsTheSame) {
  int found = 0;
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<SurfaceTile> tiles = Labyrinth(seed);
    MemoryTiles source(tiles);
    Planner ample({.cell_size_m = kCell});
    for (const PlanQuery& query : Queries(tiles, seed + 100, 6)) {
      STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult best, ample.Plan(source, query, Stop()));
      for (const std::size_t bytes : kBudgets) {
        SCOPED_TRACE(bytes);
        Planner frugal({.cell_size_m = kCell, .budget = std::make_shared<CacheBudget>(bytes)});
        STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult result, frugal.Plan(source, query, Stop()));
        EXPECT_EQ(result.reason, best.reason) << result.message;
        EXPECT_GE(result.graph_cost, best.graph_cost);
        EXPECT_LE(result.graph_cost, 1.01 * best.graph_cost);
        if (!best.found()) {
          EXPECT_EQ(result.message, best.message);
        }
      }
      best.found() ? ++found : ++refused;
    }
  }
  EXPECT_GT(found, 5);
  EXPECT_GT(refused, 0);
}

TEST(PlannerMemoryTest, APathDoesNotDependOnWhatTheCacheHolds) {
  const std::vector<SurfaceTile> tiles = Labyrinth(5);
  MemoryTiles source(tiles);
  const std::vector<PlanQuery> queries = Queries(tiles, 6, 5);
  for (const std::size_t bytes : kBudgets) {
    SCOPED_TRACE(bytes);
    Planner used({.cell_size_m = kCell, .budget = std::make_shared<CacheBudget>(bytes)});
    for (int round = 0; round < 2; ++round) {
      for (const PlanQuery& query : queries) {
        Planner fresh({.cell_size_m = kCell, .budget = std::make_shared<CacheBudget>(bytes)});
        STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult cold, fresh.Plan(source, query, Stop()));
        STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult warm, used.Plan(source, query, Stop()));
        EXPECT_EQ(warm.waypoints, cold.waypoints);
        EXPECT_EQ(warm.expanded, cold.expanded);
        EXPECT_EQ(warm.message, cold.message);
      }
    }
  }
}

TEST(PlannerMemoryTest, SearchesAtTheSameTimeShareTheBudget) {
  const std::vector<SurfaceTile> tiles = Labyrinth(7);
  MemoryTiles source(tiles);
  const std::vector<PlanQuery> queries = Queries(tiles, 8, 8);
  const auto budget = std::make_shared<CacheBudget>(20'000'000);
  Planner planner({.cell_size_m = kCell, .budget = budget});
  std::vector<PlanResult> alone;
  for (const PlanQuery& query : queries) {
    STRATA_ASSERT_OK_AND_ASSIGN(alone.emplace_back(), planner.Plan(source, query, Stop()));
  }
  std::vector<absl::StatusOr<PlanResult>> together(queries.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      threads.emplace_back([&, i] {
        MemoryTiles own(tiles);
        together[i] = planner.Plan(own, queries[i], Stop());
      });
    }
  }
  for (std::size_t i = 0; i < queries.size(); ++i) {
    STRATA_ASSERT_OK(together[i].status());
    EXPECT_EQ(together[i]->waypoints, alone[i].waypoints);
    EXPECT_EQ(together[i]->message, alone[i].message);
  }
  EXPECT_LE(budget->cached_bytes(), budget->max_bytes());
  EXPECT_TRUE(budget->Reserve(budget->max_bytes() / 2)) << "a search kept some of it";
}

TEST(PlannerMemoryTest, ASearchThatWaitsForMemoryCanBeStopped) {
  MemoryTiles source(Labyrinth(9));
  const std::vector<PlanQuery> queries = Queries(Labyrinth(9), 10, 1);
  const auto budget = std::make_shared<CacheBudget>(20'000'000);
  Planner planner({.cell_size_m = kCell, .budget = budget});
  ASSERT_TRUE(budget->Reserve(10'000'000));
  const Stop stop;
  std::jthread canceller([&stop] { stop.Request(); });
  EXPECT_THAT(planner.Plan(source, queries[0], stop),
              testing::StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
