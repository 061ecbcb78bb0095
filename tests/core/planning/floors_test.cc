// Floors of drawn worlds.
#include "core/planning/floors/floors.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/planning/endpoint.h"
#include "core/planning/planner.h"
#include "core/planning/search.h"
#include "core/planning/search_workspace.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr double kCell = 0.1;
using Code = absl::StatusCode;

class World {
 public:
  explicit World(DrawnMap& map) : source_(map.Tiles()), planner_({.cell_size_m = kCell}) {}

  absl::StatusOr<FloorPlan> Floors(const FloorQuery& query) {
    return FindFloors(planner_.cache(), source_, source_.Keys(), kCell, query, Stop());
  }
  // Of these cells, how many have no surface that the planner's search reaches from a place.
  int NotReached(const Eigen::Vector3d& from, const std::vector<CellIndex>& cells) {
    const absl::StatusOr<ProfileChecks> checks = MakeProfileChecks({}, kCell);
    SearchSpace space(planner_.cache(), source_, *checks);
    const auto start = MatchEndpoint(space, {from.x(), from.y(), from.z()});
    SearchWorkspace workspace;
    if (!start.ok() || start->patch == kNoPatchId ||
        !ReachAll(space, start->patch, workspace, Stop()).ok()) {
      return static_cast<int>(cells.size());
    }
    int missed = 0;
    for (const CellIndex& cell : cells) {
      bool reached = false;
      for (const PatchId patch : space.FindCell(cell)) {
        const int slot = space.SlotOf(patch);
        const std::uint32_t place = patch - space.slots()[slot].base;
        const PreparedTile& tile = *space.At(slot).tile;
        if (!tile.CanStand(place)) continue;
        reached = reached || workspace.DirectionOf(slot, tile, place) != ParkedTile::kUnreached;
      }
      missed += reached ? 0 : 1;
    }
    return missed;
  }
  bool Reaches(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    PlanQuery query;
    query.from = {from.x(), from.y(), from.z()};
    query.to = {to.x(), to.y(), to.z()};
    const absl::StatusOr<PlanResult> plan = planner_.Plan(source_, query, Stop());
    // Not from or to a place nearby.
    return plan.ok() && plan->found() && plan->message == "found";
  }
  std::vector<double> HeightsAt(int x, int y) {
    const auto tile = *source_.Load(TileOfCell({x, y}));
    std::vector<double> heights;
    if (tile == nullptr) return heights;
    for (const Surface& surface : tile->Cell(CellInTile({x, y}))) heights.push_back(surface.z_m);
    return heights;
  }

 private:
  MemoryTiles source_;
  Planner planner_;
};

// Ground of 60 × 24 m, over it a deck along x, 3.4 m up in the middle, that comes down to the
// ground at both ends; the ground goes on below, from y = 0 to 24 m, between abutments.
DrawnMap Bridge(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.01);
  DrawnMap map;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 600; ++x) {
      auto& column = map[{x - 300, y - 120}];
      const double m = std::abs((x + 0.5) * kCell - 30.0);
      const double deck = m < 5.0 ? 3.4 : std::max(0.0, 3.4 - (m - 5.0) * 0.17);
      const bool under_deck = y >= 100 && y < 140;
      if (!under_deck || m < 4.5) column.push_back({noise(random), 0.0, 0.01});
      if (under_deck) column.push_back({deck + noise(random), m < 4.5 ? 0.0 : deck, 0.01});
    }
  }
  return map;
}

TEST(FloorsTest, ABridgeHasTwo) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    DrawnMap map = Bridge(seed);
    World world(map);
    FloorQuery query;
    query.at = PlanEndpoint{0.0, 0.0, 3.4};
    query.cells = true;
    STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan over, world.Floors(query));
    ASSERT_EQ(over.floors.size(), 2U);
    query.at = PlanEndpoint{0.0, 0.0, 0.0};
    STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan under, world.Floors(query));
    ASSERT_TRUE(over.at.has_value() && under.at.has_value());
    EXPECT_NE(*over.at, *under.at);
    ASSERT_FALSE(over.links.empty());
    for (const FloorLink& link : over.links) EXPECT_GT(std::abs(link.slope_rad), 0.1);
  }
}

TEST(FloorsTest, FreeCellsAreReachedAndNoneIsAboveAnother) {
  DrawnMap map = Bridge(7);
  World world(map);
  FloorQuery query;
  query.cells = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, world.Floors(query));
  std::mt19937_64 random(7);
  int wrong = 0;
  int asked = 0;
  for (const Floor& floor : plan.floors) {
    std::vector<std::pair<int, int>> cells;
    for (const FloorBlock& block : floor.blocks) {
      EXPECT_EQ(block.free & block.occupied, 0U);
      EXPECT_EQ(block.free & block.ground, 0U);
      for (int i = 0; i < 64; ++i) {
        if ((block.free >> i & 1U) != 0)
          cells.emplace_back(block.x * 8 + i % 8, block.y * 8 + i / 8);
      }
    }
    EXPECT_NEAR(floor.area_m2, cells.size() * kCell * kCell, 1e-6);
    EXPECT_EQ(std::set(cells.begin(), cells.end()).size(), cells.size());
    std::vector<CellIndex> samples;
    for (int i = 0; i < 5000; ++i) {
      const auto [x, y] = cells[random() % cells.size()];
      samples.push_back({x, y});
    }
    EXPECT_EQ(world.NotReached(floor.place, samples), 0);
    for (int i = 0; i < 100; ++i) {
      const auto [x, y] = cells[random() % cells.size()];
      bool reached = false;
      for (const double z : world.HeightsAt(x, y)) {
        reached = reached || world.Reaches(floor.place, {(x + 0.5) * kCell, (y + 0.5) * kCell, z});
      }
      wrong += reached ? 0 : 1;
      ++asked;
    }
  }
  EXPECT_EQ(wrong, 0) << "of " << asked;
}

TEST(FloorsTest, TheSameMapHasTheSameFloors) {
  DrawnMap map = Bridge(3);
  FloorQuery query;
  query.cells = true;
  World first(map);
  World second(map);
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan one, first.Floors(query));
  query.at = PlanEndpoint{0.0, 0.0, 3.4};
  STRATA_ASSERT_OK(second.Floors(query));  // tiles are prepared in another order, and kept
  query.at.reset();
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan two, second.Floors(query));
  ASSERT_EQ(one.floors.size(), two.floors.size());
  for (std::size_t i = 0; i < one.floors.size(); ++i) {
    EXPECT_EQ(one.floors[i].blocks, two.floors[i].blocks);
    EXPECT_EQ(one.floors[i].place, two.floors[i].place);
  }
}

TEST(FloorsTest, AHillIsOneHoweverHigh) {
  DrawnMap map;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 600; ++x) map[{x, y}] = {{x * kCell * 0.2, 0.0, 0.01}};
  }
  World world(map);
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, world.Floors({}));
  ASSERT_EQ(plan.floors.size(), 1U);
  EXPECT_GT(plan.floors[0].high.z() - plan.floors[0].low.z(), 10.0);
}

TEST(FloorsTest, AnswersEndWhenTheyAreStopped) {
  DrawnMap map = Bridge(4);
  MemoryTiles source(map.Tiles());
  Planner planner({.cell_size_m = kCell});
  const Stop stop;
  stop.Request();
  EXPECT_THAT(FindFloors(planner.cache(), source, source.Keys(), kCell, {}, stop),
              StatusIs(Code::kCancelled, ::testing::_));
}

TEST(FloorsTest, AParapetIsOccupiedAndTheUnseenIsNeither) {
  DrawnMap map;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 80; ++x) map[{x, y}] = {{0.0, 0.0, 0.01}};
  }
  for (int x = 0; x < 80; ++x) map[{x, 40}] = {{1.0, 1.0, 0.01}};
  World world(map);
  FloorQuery query;
  query.cells = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, world.Floors(query));
  ASSERT_EQ(plan.floors.size(), 2U);  // one on either side
  EXPECT_TRUE(plan.links.empty());
  for (const Floor& floor : plan.floors) {
    for (const FloorBlock& block : floor.blocks) {
      for (int i = 0; i < 64; ++i) {
        const int x = block.x * 8 + i % 8;
        const int y = block.y * 8 + i / 8;
        if ((block.occupied >> i & 1U) != 0) {
          EXPECT_EQ(y, 40);
        }
        if (y == 40 && x > 5 && x < 75) {
          EXPECT_TRUE(block.occupied >> i & 1U) << x;
        }
        if (x < 0 || x >= 80 || y < 0 || y >= 80) {
          EXPECT_FALSE((block.free | block.occupied | block.ground) >> i & 1U);
        }
      }
    }
  }
}

TEST(FloorsTest, WhatCannotBeIsSaid) {
  DrawnMap empty;
  World world(empty);
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorPlan plan, world.Floors({}));
  EXPECT_TRUE(plan.floors.empty());
  FloorQuery query;
  query.profile.height_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(world.Floors(query), StatusIs(Code::kInvalidArgument, HasSubstr("height")));
  query = {};
  query.at = PlanEndpoint{std::numeric_limits<double>::infinity(), 0.0};
  EXPECT_THAT(world.Floors(query), StatusIs(Code::kInvalidArgument, HasSubstr("at")));
  query = {};
  query.min_area_m2 = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(world.Floors(query), StatusIs(Code::kInvalidArgument, HasSubstr("min_area_m2")));
}

}  // namespace
}  // namespace strata
