// Random worlds: costs against a plain Dijkstra over the definitions, paths against every surface.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include <gtest/gtest.h>

#include "core/planning/ground/profile_checks.h"
#include "core/planning/planner.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/core/planning/plain_planner.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::Collision;
using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;
using ::strata::testing::PlainPlanner;

constexpr double kCell = 0.1;
constexpr int kWidth = 56;

struct World {
  DrawnMap map;
  RobotProfile profile;
};

// Rolling ground with noise, kerbs, walls, poles, holes, a platform over part of it and a ramp up
// to it, across tile borders of either sign. Of some of the platform the underside was seen alone,
// of single cells and pairs of it nothing.
World RandomWorld(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.008);
  const auto pick = [&random](int n) { return static_cast<int>(random() % n); };
  const auto uniform = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  World world;
  const CellIndex corner = {256 * (pick(5) - 2) - pick(kWidth), 256 * (pick(5) - 2) - pick(kWidth)};
  const double amplitude = uniform(0.0, 0.3);
  const double wave = uniform(2.0, 5.0);
  for (int y = 0; y < kWidth; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double z = amplitude * std::sin(x * kCell / wave) * std::cos(y * kCell / wave);
      world.map[{corner.x + x, corner.y + y}] = {{z + noise(random), 0.0, uniform(0.002, 0.02)}};
    }
  }
  const auto at = [&](int x, int y) -> std::vector<testing::DrawnSurface>& {
    return world.map[{corner.x + x, corner.y + y}];
  };
  for (int k = 0; k < 4; ++k) {  // kerbs, walls
    const double height = k < 2 ? uniform(0.05, 0.25) : uniform(0.3, 2.0);
    const int x0 = pick(kWidth - 10);
    const int y0 = pick(kWidth - 10);
    const int w = k < 2 ? 10 + pick(12) : 2 + pick(25);
    const int h = k < 2 ? 10 + pick(12) : 1 + pick(2);
    for (int y = y0; y < std::min(kWidth, y0 + h); ++y) {
      for (int x = x0; x < std::min(kWidth, x0 + w); ++x) {
        at(x, y)[0].z_m += height;
        at(x, y)[0].depth_m = height;
      }
    }
  }
  const double deck = uniform(0.9, 1.6);  // sometimes too low to pass under
  std::mt19937_64 sight(seed);
  std::mt19937_64 misses(~seed);
  const int ceiling_from = 15 + static_cast<int>(sight() % 40);  // of the platform, by its column
  for (int y = 20; y < 20 + 14; ++y) {
    for (int x = 15; x < 35; ++x) {
      at(x, y).push_back({deck + noise(random), 0.2});
      if (x >= ceiling_from || sight() % 8 == 0) {
        at(x, y).back() = {deck - 0.2 + 0.01 * static_cast<double>(sight() % 4), 0.0, 0.01, true};
      }
      const std::uint64_t miss = misses() % 12;
      if (miss == 0) at(x, y).pop_back();
      if (miss == 1) at(x, y).back() = {deck - 0.3};  // its underside, which nobody knows to be one
    }
    const int run = static_cast<int>(deck / 0.03);
    for (int i = 0; i < run && 35 + i < kWidth; ++i) at(35 + i, y) = {{deck - 0.03 * (i + 1), 0.3}};
  }
  for (int k = 0; k < 14; ++k) {  // holes
    const int x0 = pick(kWidth - 8);
    const int y0 = pick(kWidth - 8);
    const int w = 1 + pick(k < 3 ? 7 : 3);
    const int h = 1 + pick(k < 7 ? 3 : 1);
    for (int y = y0; y < y0 + h; ++y) {
      for (int x = x0; x < x0 + w; ++x) world.map.Erase({corner.x + x, corner.y + y});
    }
  }
  for (int k = 0, x = pick(kWidth); k < pick(3); ++k, x = pick(kWidth)) {  // cracks
    for (int y = 0; y < kWidth; ++y) world.map.Erase({corner.x + x, corner.y + y});
  }
  world.profile = {.radius_m = uniform(0.0, 0.3),
                   .height_m = uniform(0.6, 1.4),
                   .max_step_m = uniform(0.06, 0.2),
                   .max_slope_rad = uniform(0.3, 0.6),
                   .max_gap_m = uniform(0.0, 0.4),
                   .max_roughness_m = uniform(0.03, 0.1)};
  return world;
}

PlanEndpoint EndpointOf(const PlainPlanner::Patch& patch) {
  return {.x_m = (patch.cell.x + 0.5) * kCell, .y_m = (patch.cell.y + 0.5) * kCell, .z_m = patch.z};
}

struct Tally {
  int found = 0, none = 0, off = 0, gaps = 0, pulled = 0, moved = 0, forbidden = 0;
};

// Fields of four classes, one of them 0, some 0.5 to 1.2 m wide.
int ClassOfCell(CellIndex cell) {
  const int x = (cell.x >> 3) * 5 + (cell.y >> 4) * 3;
  const int y = (cell.y >> 2) * 7 + (cell.x >> 4);
  return (x ^ y) & 3;
}

std::vector<SurfaceTile> WithClasses(std::vector<SurfaceTile> tiles) {
  for (SurfaceTile& tile : tiles) {
    for (Surface& surface : tile.surfaces) {
      surface.class_id = static_cast<std::uint8_t>(ClassOfCell(CellOf(tile.key, surface.cell)));
    }
  }
  return tiles;
}

// A path just planned holds, back too, and in the precision of a file.
void ExpectHolds(Planner& planner,
                 MemoryTiles& source,
                 const PlanQuery& query,
                 const PlanResult& result) {
  PathQuery asked = {result.waypoints, query.profile, query.class_costs};
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck check, planner.Check(source, asked, Stop()));
  EXPECT_TRUE(check.valid) << check.message;
  EXPECT_NEAR(check.length_m, result.length_m, 1e-9);
  EXPECT_TRUE(std::includes(
      check.tiles.begin(), check.tiles.end(), result.tiles.begin(), result.tiles.end()));
  std::reverse(asked.waypoints.begin(), asked.waypoints.end());
  for (Eigen::Vector3d& p : asked.waypoints) p = p.cast<float>().cast<double>();
  STRATA_ASSERT_OK_AND_ASSIGN(const PathCheck back, planner.Check(source, asked, Stop()));
  EXPECT_TRUE(back.valid) << back.message;
}

void CompareOneWorld(std::uint64_t seed, const ClassCosts& costs, Tally* tally) {
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  const World world = RandomWorld(seed);
  PlainPlanner plain(world.map, world.profile, kCell);
  plain.AddClasses(ClassOfCell, costs);
  MemoryTiles source(WithClasses(world.map.Tiles()));
  Planner planner({.cell_size_m = kCell});
  std::mt19937_64 random(seed + 1);
  for (int q = 0; q < 12; ++q) {
    const PlanEndpoint ends[2] = {EndpointOf(plain.patches()[random() % plain.patches().size()]),
                                  EndpointOf(plain.patches()[random() % plain.patches().size()])};
    const int from = plain.Place(ends[0]);
    const int to = plain.Place(ends[1]);
    const PlanQuery query = {
        .from = ends[0], .to = ends[1], .profile = world.profile, .class_costs = costs};
    STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult result, planner.Plan(source, query, Stop()));
    EXPECT_EQ(from < 0, result.reason == PlanReason::kStartNotOnSurface);
    EXPECT_EQ(from >= 0 && to < 0, result.reason == PlanReason::kGoalNotOnSurface);
    if (from < 0 || to < 0) {
      ++tally->off;
      EXPECT_FALSE(result.found());
      continue;
    }
    const double expected = plain.Cost(from, to);
    ASSERT_EQ(result.found(), std::isfinite(expected)) << result.message;
    if (!result.found()) {
      ++tally->none;
      EXPECT_NE(result.obstruction, Obstruction::kNone);
      tally->forbidden += result.obstruction == Obstruction::kClass ? 1 : 0;
      continue;
    }
    ++tally->found;
    tally->gaps += static_cast<int>(result.gaps.size());
    tally->pulled += result.cost < 0.999 * result.graph_cost ? 1 : 0;
    EXPECT_NEAR(result.graph_cost, expected, 2e-4 * expected + 1e-9);
    EXPECT_LE(result.cost, result.graph_cost * 1.0002);
    for (const auto& [patch, at] :
         {std::pair(from, result.waypoints.front()), std::pair(to, result.waypoints.back())}) {
      const PlainPlanner::Patch& p = plain.patches()[patch];
      const Eigen::Vector3d centre((p.cell.x + 0.5) * kCell, (p.cell.y + 0.5) * kCell, p.z);
      EXPECT_LT((at - centre).norm(), 1e-5);
    }
    tally->moved += absl::StrContains(result.message, "moved") ? 1 : 0;
    EXPECT_EQ(Collision(world.map, result.waypoints, world.profile, kCell), "");
    ExpectHolds(planner, source, query, result);
  }
}

TEST(PlannerOracleTest, CostsAreThoseOfDijkstraAndPathsHitNothing) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) CompareOneWorld(seed, {}, &tally);
  // The worlds are hard enough and not too hard.
  EXPECT_GT(tally.found, 30);
  EXPECT_GT(tally.none, 5);
  EXPECT_GT(tally.gaps, 3);
  EXPECT_GT(tally.pulled, 5);
  EXPECT_GT(tally.moved, 5);
}

TEST(PlannerOracleTest, EndpointsAtAnyHeightAreWhereTheyShouldBe) {
  int above = 0, below = 0, none = 0;
  for (std::uint64_t seed = 201; seed <= 212; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    const World world = RandomWorld(seed);
    const PlainPlanner plain(world.map, world.profile, kCell);
    MemoryTiles source(world.map.Tiles());
    Planner planner({.cell_size_m = kCell});
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-2.0, 2.0);
    for (int q = 0; q < 40; ++q) {
      PlanEndpoint end = EndpointOf(plain.patches()[random() % plain.patches().size()]);
      *end.z_m += off(random);
      const int place = plain.Place(end);
      const PlanQuery query = {.from = end, .to = end, .profile = world.profile};
      STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult result, planner.Plan(source, query, Stop()));
      ASSERT_EQ(result.found(), place >= 0) << result.message;
      if (place < 0) {
        EXPECT_EQ(result.reason, PlanReason::kStartNotOnSurface);
        ++none;
        continue;
      }
      const PlainPlanner::Patch& p = plain.patches()[place];
      EXPECT_NEAR(result.waypoints.front().x(), (p.cell.x + 0.5) * kCell, 1e-5);
      EXPECT_NEAR(result.waypoints.front().y(), (p.cell.y + 0.5) * kCell, 1e-5);
      EXPECT_NEAR(result.waypoints.front().z(), p.z, 1e-5);
      ++(p.z > *end.z_m ? above : below);
    }
  }
  EXPECT_GT(above, 20);
  EXPECT_GT(below, 20);
  EXPECT_GT(none, 50);
}

TEST(PlannerOracleTest, CostsOfClassesAreThoseOfDijkstraToo) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    CompareOneWorld(seed, {{1, 5.0}, {3, 1.5}}, &tally);
    CompareOneWorld(seed, {{2, kForbiddenClass}, {1, 100.0}}, &tally);
  }
  EXPECT_GT(tally.found, 15);
  EXPECT_GT(tally.pulled, 3);
  EXPECT_GT(tally.forbidden, 1);
}

// Places to stand and moves of a profile, as (cell, height) and (cell, height, cell, height).
using Place = std::tuple<int, int, float>;
struct Freedom {
  std::set<Place> places;
  std::set<std::pair<Place, Place>> moves;
};

Freedom FreedomOf(MemoryTiles& source, const RobotProfile& profile) {
  Freedom freedom;
  const auto checks = MakeProfileChecks(profile, kCell);
  STRATA_EXPECT_OK(checks);
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
  SearchSpace space(cache, source, *checks);
  for (const TileKey& key : source.Keys()) space.SlotOf(key);
  const auto place = [&space](PatchId patch) {
    const CellIndex cell = space.CellOfPatch(patch);
    return Place(cell.x, cell.y, space.Height(patch));
  };
  for (const SearchSpace::Slot& slot : space.slots()) {
    const std::shared_ptr<const PreparedTile> tile = slot.tile;
    tile->standing.ForEach([&](std::uint32_t local, std::uint32_t /*number*/) {
      const PatchId patch = slot.base + local;
      freedom.places.insert(place(patch));
      for (int k = 0; k < 8; ++k) {
        std::uint32_t cost = 0;
        int cells = 0;
        const PatchId to = space.Follow(patch, k, &cost, &cells);
        if (to != kNoPatchId) freedom.moves.emplace(place(patch), place(to));
      }
    });
  }
  return freedom;
}

TEST(PlannerOracleTest, WhoCanDoMoreMayStandAndMoveWhereverWhoCanDoLessMay) {
  std::size_t gained = 0;
  for (std::uint64_t seed = 101; seed <= 124; ++seed) {
    const World world = RandomWorld(seed);
    MemoryTiles source(world.map.Tiles());
    const Freedom less = FreedomOf(source, world.profile);
    std::mt19937_64 random(seed);
    const auto factor = [&random](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int way = 0; way < 6; ++way) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " way " << way);
      RobotProfile able = world.profile;  // one thing better, then all of them
      if (way == 0 || way == 5) able.max_step_m *= factor(1.1, 2.5);
      if (way == 1 || way == 5) able.max_slope_rad *= factor(1.1, 1.6);
      if (way == 2 || way == 5) able.max_gap_m += factor(0.1, 0.4);
      if (way == 3 || way == 5) able.radius_m *= factor(0.3, 0.9);
      if (way == 4 || way == 5) able.height_m *= factor(0.93, 0.99);
      const Freedom more = FreedomOf(source, able);
      EXPECT_TRUE(std::includes(
          more.places.begin(), more.places.end(), less.places.begin(), less.places.end()));
      EXPECT_TRUE(std::includes(
          more.moves.begin(), more.moves.end(), less.moves.begin(), less.moves.end()));
      gained += more.places.size() - less.places.size();
    }
  }
  EXPECT_GT(gained, 1000U);
}

}  // namespace
}  // namespace strata
