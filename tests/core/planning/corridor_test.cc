// Whether what a corridor knows of the costs of long ways holds, beside the costs themselves.
#include "core/planning/corridor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/planning/least_dangers.h"
#include "core/planning/packed_tile.h"
#include "core/planning/planner.h"
#include "core/planning/search_bounds.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::KeptTiles;

constexpr double kCell = 0.1;

// Walls with gaps, unobserved strips that a wide gap leads over, dangerous ground and two decks.
std::vector<SurfaceTile> World(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto pick = [&random](int n) { return static_cast<int>(random() % n); };
  const int width = 420;
  const int height = 330;
  const CellIndex corner = {-100 - pick(200), -100 - pick(200)};
  const int wall = 40 + pick(30);
  const int gap = pick(280);
  const int strip = 4 + pick(3);
  const double rough = 0.002 + 0.004 * pick(4);
  std::normal_distribution<double> noise(0.0, 1.0);
  DrawnMap map;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const CellIndex cell = {corner.x + x, corner.y + y};
      if (x % wall < 2 && (y < gap || y > gap + 20)) {
        map[cell] = {{2.0, 2.5}};
      } else if ((x + 2 * y) % 90 >= strip && (y % 70 != 0 || x % 3 == 0)) {
        const double z = 0.2 * std::sin(x / 31.0) + rough * ((y / 60) % 3) * noise(random);
        map[cell] = {{z}};
        if (y > 100 && y < 160) map[cell].push_back({z + 3.0, 0.3});
      }
    }
  }
  return map.Tiles();
}

// From one place to all others, by the moves themselves.
std::map<PatchId, std::uint32_t> CostsFrom(SearchSpace& space, PatchId start) {
  using Item = std::pair<std::uint32_t, PatchId>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  std::map<PatchId, std::uint32_t> costs;
  queue.emplace(0, start);
  while (!queue.empty()) {
    const auto [cost, patch] = queue.top();
    queue.pop();
    if (!costs.try_emplace(patch, cost).second) continue;
    for (int k = 0; k < 8; ++k) {
      std::uint32_t move = 0;
      int cells = 0;
      const PatchId to = space.Follow(patch, k, &move, &cells);
      if (to != kNoPatchId && !costs.contains(to)) queue.emplace(cost + move, to);
    }
  }
  return costs;
}

std::vector<RobotProfile> Profiles() {
  RobotProfile small;
  small.radius_m = 0.05;
  small.max_gap_m = 1.2;
  RobotProfile rough;
  rough.max_step_m = 0.4;
  rough.max_gap_m = 0.0;
  return {RobotProfile(), small, rough};
}

absl::StatusOr<std::optional<Corridor>> FindCorridor(SearchSpace& space, PatchId from, PatchId to) {
  return Corridor::Find([&space](const TileKey& key) { return space.KeptDangers(key); },
                        space.CellOfPatch(from),
                        space.CellOfPatch(to),
                        space.checks().GapCells(1),
                        std::size_t{1} << 24,
                        Stop());
}

// Beside what some places cost to the goal; returns how many there were.
std::size_t CheckCosts(SearchSpace& space,
                       const Corridor& corridor,
                       PatchId start,
                       const std::map<PatchId, std::uint32_t>& costs,
                       const std::vector<PatchId>& places,
                       std::mt19937_64& random) {
  const CellIndex begin = space.CellOfPatch(start);
  const Corridor::Tile* const first = corridor.Find(TileOfCell(begin));
  EXPECT_TRUE(first != nullptr && first->inside.test(Corridor::BlockOf(begin)));
  std::size_t checked = 0;
  for (int i = 0; i < 300; ++i) {
    const auto cost = costs.find(places[random() % places.size()]);
    if (cost == costs.end()) continue;
    const CellIndex cell = space.CellOfPatch(cost->first);
    const Corridor::Tile* const tile = corridor.Find(TileOfCell(cell));
    if (tile != nullptr) {
      EXPECT_LE(tile->costs[Corridor::BlockOf(cell)], cost->second) << "of " << cost->first;
      ++checked;
    } else {
      const OctileBound straight{begin};
      EXPECT_GE(straight.Outside(cell) + cost->second, corridor.limit());
    }
  }
  return checked;
}

TEST(CorridorTest, NoWayCostsLess) {
  std::size_t beside = 0;
  double tightest = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const RobotProfile& profile : Profiles()) {
      SCOPED_TRACE(seed);
      SCOPED_TRACE(profile.max_gap_m);
      KeptTiles source(World(seed));
      STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks(profile, kCell));
      STRATA_ASSERT_OK(source.Keep(checks));
      TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
      SearchSpace space(cache, source, checks);
      std::vector<PatchId> places;
      for (const TileKey& key : source.Keys()) {
        const SearchSpace::Slot& slot = space.At(space.SlotOf(key));
        slot.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
          places.push_back(slot.base + place);
        });
      }
      std::mt19937_64 random(seed);
      for (int to = 0; to < 3; ++to) {
        const PatchId goal = places[random() % places.size()];
        const std::map<PatchId, std::uint32_t> costs = CostsFrom(space, goal);
        for (int from = 0; from < 20; ++from) {
          const PatchId start = places[random() % places.size()];
          STRATA_ASSERT_OK_AND_ASSIGN(const auto corridor, FindCorridor(space, start, goal));
          const auto cost = costs.find(start);
          if (cost == costs.end()) continue;
          ASSERT_TRUE(corridor.has_value());
          ASSERT_LE(corridor->least_cost(), cost->second) << start << " to " << goal;
          tightest = std::max(tightest, corridor->least_cost() / double(cost->second));
          beside += CheckCosts(space, *corridor, start, costs, places, random);
        }
      }
      STRATA_EXPECT_OK(space.status());
    }
  }
  EXPECT_GT(beside, 10000U);
  EXPECT_GT(tightest, 0.9) << "it says nothing";
}

TEST(CorridorTest, WhereNothingIsKeptAllIsOpen) {
  KeptTiles source(World(3));
  STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks({}, kCell));
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
  const TileKey key = source.Keys().front();
  EXPECT_FALSE(cache.IsKept(source, key, checks));
  EXPECT_EQ(*cache.KeptDangers(source, key, checks), LeastDangers());
  LeastDangers closed;
  closed.fill(kClosedBlock);
  EXPECT_EQ(*cache.KeptDangers(source, {0, 1000, 1000}, checks), closed);
  STRATA_ASSERT_OK(source.Keep(checks));
  EXPECT_TRUE(cache.IsKept(source, key, checks));
  EXPECT_NE(*cache.KeptDangers(source, key, checks), LeastDangers());
}

TEST(CorridorTest, WithLittleMemoryThereIsNone) {
  KeptTiles source(World(3));
  STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks({}, kCell));
  STRATA_ASSERT_OK(source.Keep(checks));
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
  const auto find = [&](std::size_t bytes) {
    return Corridor::Find(
        [&](const TileKey& key) -> absl::StatusOr<std::shared_ptr<const LeastDangers>> {
          return cache.KeptDangers(source, key, checks);
        },
        {-50, -50},
        {60, 60},
        checks.GapCells(1),
        bytes,
        Stop());
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto ample, find(std::size_t{1} << 24));
  EXPECT_TRUE(ample.has_value());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto little, find(1024));
  EXPECT_FALSE(little.has_value());
}

// A bent street of 500 m with dead ends.
std::vector<SurfaceTile> Street(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.004);
  const double phase = static_cast<double>(random() % 100);
  DrawnMap map;
  for (int x = 0; x < 5000; ++x) {
    const double middle = 60.0 * std::sin((x + phase) / 180.0);
    const bool yard = (x / 70) % 5 == 0;
    for (int y = -180; y < 180; ++y) {
      const double off = std::abs(y - middle);
      if (off < 50.0 || (yard && off < 120.0)) map[{x, y}] = {{noise(random)}};
    }
  }
  return map.Tiles();
}

TEST(CorridorTest, LongPlansAreWithinOnePercentWhateverTheCacheHolds) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<SurfaceTile> tiles = Street(seed);
    KeptTiles source(tiles);
    testing::MemoryTiles bare(tiles);
    STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks({}, kCell));
    STRATA_ASSERT_OK(source.Keep(checks));
    const double phase = static_cast<double>(std::mt19937_64(seed)() % 100);
    const auto place = [phase](int x) {
      return PlanEndpoint{.x_m = x * kCell, .y_m = 6.0 * std::sin((x + phase) / 180.0)};
    };
    PlanQuery query;
    query.from = place(20);
    query.to = place(4980);
    for (int classes = 0; classes < 2; ++classes) {
      if (classes == 1) query.class_costs = {{7, 1.5}};
      const auto budget = std::make_shared<CacheBudget>(6'000'000);
      Planner ample({.cell_size_m = kCell});
      STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult best, ample.Plan(bare, query, Stop()));
      ASSERT_TRUE(best.found()) << best.message;
      Planner frugal({.cell_size_m = kCell, .budget = budget});
      STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult cold, frugal.Plan(source, query, Stop()));
      ASSERT_TRUE(cold.found()) << cold.message;
      EXPECT_GE(cold.graph_cost, best.graph_cost);
      EXPECT_LE(cold.graph_cost, 1.01 * best.graph_cost);
      EXPECT_LT(cold.expanded, 0.75 * best.expanded) << "it was not searched in a corridor";
      STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult warm, frugal.Plan(source, query, Stop()));
      EXPECT_EQ(warm.waypoints, cold.waypoints);
      EXPECT_EQ(warm.expanded, cold.expanded);
      EXPECT_TRUE(budget->Reserve(budget->max_bytes() / 2)) << "a search kept some of it";
    }
  }
}

}  // namespace
}  // namespace strata
