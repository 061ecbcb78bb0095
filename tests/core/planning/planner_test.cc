// Drawn worlds: what a robot may do and what it is told when it may not.
#include "core/planning/planner.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/planning/memory_tiles.h"
#include "tests/core/planning/small_robot.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::At;
using ::strata::testing::DrawnMap;
using ::strata::testing::kCell;
using ::strata::testing::Legend;
using ::strata::testing::MapFromDrawing;
using ::strata::testing::MemoryTiles;
using ::strata::testing::PlanIn;
using ::strata::testing::SmallRobot;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

double HighestPoint(const PlanResult& result) {
  double z = -1e9;
  for (const Eigen::Vector3d& p : result.waypoints) z = std::max(z, p.z());
  return z;
}

// A road under a bridge: '.' road, a to e the ramp up, '=' deck at 1.5 m over the road, seen from
// both sides and so a thick interval.
Legend BridgeLegend(double deck_z, double deck_depth) {
  return {{'.', {{0.0}}},
          {'=', {{0.0}, {deck_z, deck_depth}}},
          {'#', {{0.0}, {deck_z + 1.0, deck_depth + 1.0}}}};
}

// The deck runs west to east at y in [2.5, 4.5], with ramps of 0.25 rad at both ends.
DrawnMap Bridge(double deck_z, double deck_depth, char side) {
  std::string row(28, '=');
  std::string side_row(28, side);
  const std::string road(28, '.');
  std::string drawing;
  for (int i = 0; i < 5; ++i) drawing += road + "\n";
  drawing += side_row + "\n" + row + "\n" + row + "\n" + row + "\n" + side_row + "\n";
  for (int i = 0; i < 5; ++i) drawing += road + "\n";
  DrawnMap map = MapFromDrawing(drawing, BridgeLegend(deck_z, deck_depth), 5);
  const int ramp_cells = static_cast<int>(deck_z / 0.025);
  for (int y = 25; y < 50; ++y) {
    const bool parapet = side == '#' && (y < 30 || y >= 45);
    for (int i = 0; i < ramp_cells; ++i) {
      const double z = deck_z - 0.025 * (i + 1);
      for (const int x : {-1 - i, 140 + i}) map[{x, y}] = {{parapet ? z + 1.0 : z, z + 1.0}};
    }
  }
  return map;
}

TEST(PlannerTest, CrossesABridgeAndPassesUnderItAtTheSamePlace) {
  for (const char side : {'=', '#'}) {
    SCOPED_TRACE(side);
    const DrawnMap map = Bridge(1.5, 0.3, side);
    const PlanResult over = PlanIn(map, At(1.05, 3.75, 1.5), At(13.05, 3.75, 1.5));
    ASSERT_TRUE(over.found()) << over.message;
    EXPECT_NEAR(over.length_m, 12.0, 0.01);
    EXPECT_GE(over.cost, over.length_m - 1e-9);
    EXPECT_LE(over.cost, over.graph_cost * 1.0002);
    const PlanResult under = PlanIn(map, At(7.05, 1.05, 0), At(7.05, 6.45, 0));
    ASSERT_TRUE(under.found()) << under.message;
    EXPECT_NEAR(under.length_m, 5.4, 0.01);
    EXPECT_NEAR(HighestPoint(under), 0.0, 1e-6);
  }
}

TEST(PlannerTest, ReachesTheDeckByTheRampAndNotOverItsEdge) {
  for (const char side : {'=', '#'}) {
    SCOPED_TRACE(side);
    DrawnMap map = Bridge(1.5, 0.3, side);
    const int toe = 60;  // cells of ramp
    for (int y = 0; y < 75; ++y) {
      for (int x = -toe - 20; x < -toe; ++x) map[{x, y}] = {{0.0}};
      for (int x = -toe; x < 0; ++x) {
        if (y < 25 || y >= 50) map[{x, y}] = {{0.0}};
      }
    }
    const PlanResult result = PlanIn(map, At(7.05, 1.05, 0), At(7.05, 3.75, 1.5));
    ASSERT_TRUE(result.found()) << result.message;
    EXPECT_GT(result.length_m, 2 * 13.0);  // out to the toe at x = -6 and back
  }
}

TEST(PlannerTest, NamesTheClearanceThatIsTooLow) {
  const DrawnMap map = Bridge(1.1, 0.3, '=');
  const PlanResult result = PlanIn(map, At(7.05, 1.05, 0), At(7.05, 6.45, 0));
  EXPECT_EQ(result.reason, PlanReason::kBlocked);
  EXPECT_EQ(result.obstruction, Obstruction::kClearance);
  EXPECT_NEAR(result.obstruction_value, 0.8, 1e-5);
  ASSERT_TRUE(result.where.has_value());
  EXPECT_NEAR(result.where->y(), 2.55, 0.051);
  EXPECT_THAT(result.message, HasSubstr("clearance of 0.80 m"));
}

// Two terraces, the northern one `rise` higher.
DrawnMap Terraces(double rise) {
  return MapFromDrawing("hhhhhhhh\nhhhhhhhh\nhhhhhhhh\nllllllll\nllllllll\nllllllll",
                        {{'l', {{0.0}}}, {'h', {{rise, rise}}}},
                        5);
}

TEST(PlannerTest, TakesAStepAtTheLimitAndRefusesOneJustOver) {
  const PlanResult up = PlanIn(Terraces(0.15), At(2.05, 0.55, 0), At(2.05, 2.55, 0.15));
  ASSERT_TRUE(up.found()) << up.message;
  EXPECT_NEAR(up.waypoints.back().z(), 0.15, 1e-6);
  const PlanResult over = PlanIn(Terraces(0.16), At(2.05, 0.55, 0), At(2.05, 2.55, 0.16));
  EXPECT_EQ(over.reason, PlanReason::kBlocked);
  EXPECT_EQ(over.obstruction, Obstruction::kStep);
  EXPECT_NEAR(over.obstruction_value, 0.16, 1e-5);
  EXPECT_THAT(PlanIn(Terraces(0.31), At(2.05, 0.55, 0), At(2.05, 2.55, 0.31)).message,
              HasSubstr("step of 0.31 m"));
  const PlanResult down = PlanIn(Terraces(0.16), At(2.05, 2.55, 0.16), At(2.05, 0.55, 0));
  EXPECT_EQ(down.obstruction, Obstruction::kDrop);
  EXPECT_NEAR(down.obstruction_value, 0.16, 1e-5);
}

TEST(PlannerTest, GoesAroundAWallAndNamesTheOneThatClosesTheWay) {
  const Legend legend = {{'.', {{0.0}}}, {'#', {{2.0, 2.0}}}};
  const DrawnMap open = MapFromDrawing("........\n........\n.######.\n........", legend, 5);
  const PlanResult around = PlanIn(open, At(2.05, 0.25, 0), At(2.05, 1.75, 0));
  ASSERT_TRUE(around.found()) << around.message;
  EXPECT_GT(around.length_m, 3.0);
  const DrawnMap closed = MapFromDrawing("........\n........\n########\n........", legend, 5);
  const PlanResult blocked = PlanIn(closed, At(2.05, 0.25, 0), At(2.05, 1.75, 0));
  EXPECT_EQ(blocked.reason, PlanReason::kBlocked);
  EXPECT_EQ(blocked.obstruction, Obstruction::kObstacle);
  EXPECT_NEAR(blocked.obstruction_value, 2.0, 1e-5);
}

// Paving, 10 m by 6 m, across which lies a lawn; with a way around it at its upper end.
std::vector<SurfaceTile> Garden(bool way_around) {
  DrawnMap map;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 100; ++x) map[{x, y}] = {{0.0}};
  }
  std::vector<SurfaceTile> tiles = map.Tiles();
  for (SurfaceTile& tile : tiles) {
    for (Surface& surface : tile.surfaces) {
      const CellIndex cell = CellOf(tile.key, surface.cell);
      const bool lawn = cell.x >= 40 && cell.x < 60 && (!way_around || cell.y < 50);
      surface.class_id = lawn ? 3 : 1;
    }
  }
  return tiles;
}

TEST(PlannerTest, GoesAroundWhatClassesCostAndNeverOverWhatTheyForbid) {
  MemoryTiles garden(Garden(true));
  Planner planner({.cell_size_m = kCell});
  PlanQuery query = {.from = At(2.05, 1.05, 0), .to = At(8.05, 1.05, 0), .profile = SmallRobot()};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult straight, planner.Plan(garden, query, Stop()));
  EXPECT_NEAR(straight.length_m, 6.0, 0.1);
  query.class_costs = {{3, 2.0}};  // 2 m dearer, the way around is 4 m longer
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult across, planner.Plan(garden, query, Stop()));
  EXPECT_NEAR(across.length_m, straight.length_m, 1e-9);
  EXPECT_NEAR(across.cost - straight.cost, 2.0, 0.3);
  for (const double factor : {20.0, kForbiddenClass}) {
    query.class_costs = {{3, factor}};
    STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult around, planner.Plan(garden, query, Stop()));
    ASSERT_TRUE(around.found()) << around.message;
    EXPECT_GT(around.length_m, 8.0);
    const auto highest = std::max_element(
        around.waypoints.begin(), around.waypoints.end(), [](const auto& a, const auto& b) {
          return a.y() < b.y();
        });
    EXPECT_GT(highest->y(), 5.0);
  }
  // The prepared tiles are those of every query.
  EXPECT_EQ(planner.cache_statistics().prepared, 1U);
}

TEST(PlannerTest, NamesTheForbiddenClassThatIsInTheWay) {
  MemoryTiles garden(Garden(false));
  Planner planner({.cell_size_m = kCell});
  PlanQuery query = {.from = At(2.05, 1.05, 0), .to = At(8.05, 1.05, 0), .profile = SmallRobot()};
  query.class_costs = {{3, kForbiddenClass}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult blocked, planner.Plan(garden, query, Stop()));
  EXPECT_EQ(blocked.reason, PlanReason::kBlocked);
  EXPECT_EQ(blocked.obstruction, Obstruction::kClass);
  EXPECT_EQ(blocked.obstruction_value, 3.0);
  EXPECT_THAT(blocked.message, HasSubstr("forbidden class 3 at (4.05, "));
  query.to = At(5.05, 1.05, 0);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult on_it, planner.Plan(garden, query, Stop()));
  EXPECT_EQ(on_it.reason, PlanReason::kGoalNotOnSurface);
  EXPECT_EQ(on_it.obstruction, Obstruction::kClass);
  for (const auto& [id, factor] :
       {std::pair(0, 2.0), std::pair(256, 2.0), std::pair(1, 0.5), std::pair(1, 101.0)}) {
    query.class_costs = {{id, factor}};
    EXPECT_THAT(planner.Plan(garden, query, Stop()),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("class_costs: ")));
  }
}

TEST(PlannerTest, RampsBetweenStoreysByTheirSlope) {
  const auto storeys = [](double slope_tan) {
    DrawnMap map = MapFromDrawing("....\n....", {{'.', {{0.0}}}}, 10, {-40, 0});
    const int cells = static_cast<int>(std::lround(2.5 / (slope_tan * kCell)));
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < cells; ++x) map[{x, y}] = {{slope_tan * kCell * (x + 1)}};
      for (int x = cells; x < cells + 40; ++x) map[{x, y}] = {{slope_tan * kCell * cells}};
    }
    return map;
  };
  const PlanResult gentle = PlanIn(storeys(0.3), At(-3.05, 1.05, 0), At(10.05, 1.05, 2.5));
  ASSERT_TRUE(gentle.found()) << gentle.message;
  EXPECT_NEAR(gentle.waypoints.back().z(), 2.5, 0.02);
  const PlanResult steep = PlanIn(storeys(0.6), At(-3.05, 1.05, 0), At(6.05, 1.05, 2.5));
  EXPECT_EQ(steep.reason, PlanReason::kBlocked);
  EXPECT_EQ(steep.obstruction, Obstruction::kSlope);
  // At the toe the planes lie between the floor and the ramp.
  EXPECT_GT(steep.obstruction_value, SmallRobot().max_slope_rad);
  EXPECT_LE(steep.obstruction_value, std::atan(0.6) + 1e-4);
}

TEST(PlannerTest, BridgesAnUnobservedStretchUpToTheLimitAndListsIt) {
  const auto split = [](int hole_cells) {
    DrawnMap map = MapFromDrawing("........\n........", {{'.', {{0.0}}}}, 10);
    for (int y = 0; y < 20; ++y) {
      for (int x = 40; x < 40 + hole_cells; ++x) map.Erase({x, y});
    }
    return map;
  };
  const PlanResult bridged = PlanIn(split(3), At(1.05, 1.05, 0), At(7.05, 1.05, 0));
  ASSERT_TRUE(bridged.found()) << bridged.message;
  ASSERT_EQ(bridged.gaps.size(), 1U);
  EXPECT_NEAR(bridged.gaps[0].length_m, 0.4, 1e-6);
  EXPECT_NEAR(bridged.gaps[0].from.x(), 3.95, 1e-6);
  EXPECT_NEAR(bridged.cost, 6.0 + 0.3 * kGapDanger, 0.05);
  const PlanResult wide = PlanIn(split(4), At(1.05, 1.05, 0), At(7.05, 1.05, 0));
  EXPECT_EQ(wide.reason, PlanReason::kUnknownGround);
  EXPECT_EQ(wide.obstruction, Obstruction::kUnknown);
  EXPECT_NEAR(wide.obstruction_value, 0.4, 1e-6);
}

// A hole that alone would be bridged; what is behind it stops, and is told.
TEST(PlannerTest, NamesTheDropBehindAHoleThatWouldBeBridged) {
  DrawnMap map = MapFromDrawing("........\n........", {{'.', {{0.0}}}}, 10);
  for (int y = 0; y < 20; ++y) {
    for (int x = 40; x < 43; ++x) map.Erase({x, y});
    for (int x = 43; x < 80; ++x) map[{x, y}] = {{-0.4}};
  }
  const PlanResult result = PlanIn(map, At(1.05, 1.05, 0), At(7.05, 1.05, -0.4));
  EXPECT_EQ(result.reason, PlanReason::kBlocked) << result.message;
  EXPECT_EQ(result.obstruction, Obstruction::kDrop) << result.message;
  EXPECT_NEAR(result.obstruction_value, 0.4, 1e-6);
  ASSERT_TRUE(result.where.has_value());
  EXPECT_NEAR(result.where->x(), 4.35, 1e-6);
}

TEST(PlannerTest, StartAndGoalOffTheMapNameTheNearestPlace) {
  const DrawnMap map = MapFromDrawing("....\n....", {{'.', {{0.0}}}}, 10);
  const PlanResult start = PlanIn(map, At(-1.0, 1.05, 0), At(2.05, 1.05, 0));
  EXPECT_EQ(start.reason, PlanReason::kStartNotOnSurface);
  ASSERT_TRUE(start.nearest.has_value());
  EXPECT_NEAR(start.nearest->x(), 0.25, 0.051);  // a radius away from unknown ground
  EXPECT_NEAR(start.nearest->y(), 1.05, 0.051);
  const PlanResult goal = PlanIn(map, At(2.05, 1.05, 0), At(100.0, 1.05, 0));
  EXPECT_EQ(goal.reason, PlanReason::kGoalNotOnSurface);
  ASSERT_TRUE(goal.nearest.has_value());  // however far off
  EXPECT_NEAR(goal.nearest->x(), 3.75, 0.051);
  EXPECT_NEAR(goal.nearest->y(), 1.05, 0.051);
}

TEST(PlannerTest, EndpointsMoveToTheNearestPlaceOnTheirLevel) {
  DrawnMap map = Bridge(1.5, 0.3, '=');
  for (int y = 8; y < 12; ++y) {
    for (int x = 8; x < 12; ++x) map.Erase({x, y});  // below a sensor at (1, 1)
  }
  const PlanResult start = PlanIn(map, At(1.0, 1.0, 0.05), At(7.05, 1.05, 0));
  ASSERT_TRUE(start.found()) << start.message;
  EXPECT_THAT(start.message, HasSubstr("found; start moved 0.25 m"));
  EXPECT_THAT(start.message, HasSubstr("no surface at (1.00, 1.00)"));
  const Eigen::Vector3d first = start.waypoints.front();
  EXPECT_LE(std::hypot(first.x() - 1.0, first.y() - 1.0), 0.5);
  EXPECT_NEAR(first.z(), 0.0, 1e-6);
  // No higher than a step and slope from the height asked for.
  EXPECT_EQ(PlanIn(map, At(1.0, 1.0, 0.4), At(7.05, 1.05, 0)).reason,
            PlanReason::kStartNotOnSurface);

  // At the deck's edge: the deck, not the road beneath; by level the same.
  for (const bool by_level : {false, true}) {
    PlanEndpoint goal = At(11.05, 2.55, 1.5);
    if (by_level) goal = {.x_m = 11.05, .y_m = 2.55, .level = 1};
    const PlanResult edge = PlanIn(map, At(3.05, 3.75, 1.5), goal);
    ASSERT_TRUE(edge.found()) << edge.message;
    EXPECT_THAT(edge.message, HasSubstr("goal moved 0.2"));
    EXPECT_THAT(edge.message, HasSubstr("drop of 1.50 m"));
    EXPECT_NEAR(edge.waypoints.back().z(), 1.5, 1e-6);
  }
}

// The floor below the deck was not seen around (7, 3.75): a goal there is no goal on the deck.
TEST(PlannerTest, AGoalIsNeverTakenToAnotherStorey) {
  DrawnMap map = Bridge(2.9, 0.3, '=');
  for (int y = 25; y < 50; ++y) {
    for (int x = 55; x < 85; ++x) map[{x, y}] = {{2.9, 0.3}};
  }
  const PlanEndpoint deck = At(3.05, 3.75, 2.9);
  const PlanResult lost = PlanIn(map, deck, At(7.05, 3.75, 0.0));
  EXPECT_EQ(lost.reason, PlanReason::kGoalNotOnSurface) << lost.message;
  EXPECT_THAT(lost.message, HasSubstr("no surface within 1.00 m, the robot's height, of z = 0.00"));
  ASSERT_TRUE(lost.nearest.has_value());
  EXPECT_THAT(lost.message, HasSubstr("m above the z asked for"));
  // Up to the robot's height off is the storey that was meant, from above and from below.
  for (const double off : {-0.99, 0.0, 0.99}) {
    const PlanResult meant = PlanIn(map, deck, At(7.05, 3.75, 2.9 + off));
    ASSERT_TRUE(meant.found()) << meant.message;
    EXPECT_NEAR(meant.waypoints.back().z(), 2.9, 1e-6);
  }
  for (const double off : {-1.01, 1.01}) {
    EXPECT_EQ(PlanIn(map, deck, At(7.05, 3.75, 2.9 + off)).reason, PlanReason::kGoalNotOnSurface);
    EXPECT_EQ(PlanIn(map, At(7.05, 3.75, 2.9 + off), deck).reason, PlanReason::kStartNotOnSurface);
  }
}

// Half a metre below a beam on which nobody can stand, and 0.95 m above the floor.
TEST(PlannerTest, AGoalAtTheHeightOfASensorIsOnTheFloorAndNotOnTheBeamAbove) {
  DrawnMap map = MapFromDrawing("......\n......\n......", {{'.', {{0.0}}}}, 10);
  for (int y = 0; y < 30; ++y) map[{40, y}] = {{0.0}, {1.45, 0.1}};
  const PlanResult result = PlanIn(map, At(1.05, 1.55, 0), At(4.05, 1.55, 0.95));
  ASSERT_TRUE(result.found()) << result.message;
  EXPECT_NEAR(result.waypoints.back().z(), 0.0, 1e-6);
  EXPECT_THAT(result.message, HasSubstr("; goal moved 0.00 m to (4.05, 1.55, 0.00)"));
}

// A storey above the goal whose wall is nearest to it; the ramp leads to ground that
// unobserved cells separate from the goal's.
TEST(PlannerTest, NamesTheMoveThatSeparatesAndNotTheWallAboveTheGoal) {
  DrawnMap map = Bridge(1.5, 0.3, '#');
  for (int y = 0; y < 75; ++y) {
    for (int x = -100; x < -60; ++x) map[{x, y}] = {{0.0}};
  }
  const PlanResult result = PlanIn(map, At(7.05, 3.75, 1.5), At(7.05, 3.75, 0));
  EXPECT_FALSE(result.found());
  EXPECT_EQ(result.reason, PlanReason::kUnknownGround) << result.message;
}

TEST(PlannerTest, TakesStartAndGoalByLevel) {
  const DrawnMap map = Bridge(1.5, 0.3, '=');
  PlanQuery query = {.from = {.x_m = 3.05, .y_m = 3.75, .level = 1},
                     .to = {.x_m = 11.05, .y_m = 3.75, .level = 1},
                     .profile = SmallRobot()};
  EXPECT_NEAR(HighestPoint(PlanIn(map, query)), 1.5, 1e-6);
  query.from.level = 0;
  query.to.level.reset();  // the lowest
  EXPECT_NEAR(HighestPoint(PlanIn(map, query)), 0.0, 1e-6);
  query.to.level = 2;
  const PlanResult none = PlanIn(map, query);
  EXPECT_EQ(none.reason, PlanReason::kGoalNotOnSurface);
  EXPECT_THAT(none.message, HasSubstr("no level 2"));
}

TEST(PlannerTest, AnswersDoNotDependOnWhereTheTileBordersLie) {
  const Legend legend = {{'.', {{0.0}}}, {'#', {{2.0, 2.0}}}};
  const char* const drawing = "..........\n..####....\n.....#....\n.....#.##.\n..........";
  std::vector<double> costs;
  for (const CellIndex corner : {CellIndex{20, 20}, {-25, -25}, {-281, 231}, {230, -26}}) {
    const DrawnMap map = MapFromDrawing(drawing, legend, 5, corner);
    const double x = corner.x * kCell;
    const double y = corner.y * kCell;
    const PlanResult result = PlanIn(map, At(x + 0.55, y + 0.75, 0), At(x + 4.45, y + 2.05, 0));
    ASSERT_TRUE(result.found()) << result.message;
    costs.push_back(result.graph_cost);
  }
  for (const double cost : costs) EXPECT_DOUBLE_EQ(cost, costs[0]);
}

TEST(PlannerTest, ChangedTilesAreNeverUsedStaleAndUnchangedOnesPreparedOnce) {
  const Legend legend = {{'.', {{0.0}}}, {'#', {{2.0, 2.0}}}};
  MemoryTiles open(MapFromDrawing("......\n......\n......", legend, 5).Tiles(7));
  MemoryTiles closed(MapFromDrawing("...#..\n...#..\n...#..", legend, 5).Tiles(8));
  Planner planner({.cell_size_m = kCell});
  const PlanQuery query = {
      .from = At(0.55, 0.75, 0), .to = At(2.45, 0.75, 0), .profile = SmallRobot()};
  const auto reason = [&](MemoryTiles& tiles, const PlanQuery& asked) {
    const auto result = planner.Plan(tiles, asked, Stop());
    STRATA_EXPECT_OK(result);
    return result.ok() ? result->reason : PlanReason::kSearchLimit;
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reason(open, query), PlanReason::kFound);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reason(closed, query), PlanReason::kBlocked);
  EXPECT_EQ(planner.cache_statistics().prepared, 2U);
  PlanQuery other = query;
  other.profile.radius_m = 0.3;
  EXPECT_EQ(reason(closed, other), PlanReason::kBlocked);
  EXPECT_EQ(planner.cache_statistics().prepared, 3U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(reason(open, query), PlanReason::kFound);
    EXPECT_EQ(reason(closed, query), PlanReason::kBlocked);
  }
}

TEST(PlannerTest, AMapThatChangesTakesNoMoreMemoryThanOneThatDoesNot) {
  const Legend legend = {{'.', {{0.0}}}};
  Planner planner({.cell_size_m = kCell});
  std::set<std::size_t> bytes;
  for (std::uint64_t version = 1; version <= 20; ++version) {
    MemoryTiles tiles(MapFromDrawing("......\n......\n......", legend, 5).Tiles(version));
    const PlanQuery query = {
        .from = At(0.55, 0.75, 0), .to = At(2.45, 0.75, 0), .profile = SmallRobot()};
    STRATA_EXPECT_OK(planner.Plan(tiles, query, Stop()));
    bytes.insert(planner.cache_statistics().bytes);
  }
  EXPECT_EQ(bytes.size(), 1U) << *bytes.rbegin();
}

TEST(PlannerTest, WorksWithACacheThatHoldsNothing) {
  MemoryTiles source(Bridge(1.5, 0.3, '=').Tiles());
  Planner planner({.cell_size_m = kCell, .budget = std::make_shared<CacheBudget>(400'000)});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PlanResult result,
      planner.Plan(
          source,
          {.from = At(1.05, 3.75, 1.5), .to = At(13.05, 3.75, 1.5), .profile = SmallRobot()},
          Stop()));
  EXPECT_TRUE(result.found());
}

TEST(PlannerTest, ALongWayTakesLittleMemory) {
  // 120 m, five tiles: 1.6 MB once prepared, 0.3 MB of nodes.
  const std::string row(240, '.');
  MemoryTiles source(
      MapFromDrawing(row + "\n" + row + "\n" + row + "\n" + row + "\n" + row, {{'.', {{0.0}}}}, 5)
          .Tiles());
  const PlanQuery query = {
      .from = At(1.05, 1.05, 0), .to = At(118.95, 1.45, 0), .profile = SmallRobot()};
  Planner ample({.cell_size_m = kCell});
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult there, ample.Plan(source, query, Stop()));
  ASSERT_TRUE(there.found()) << there.message;
  const auto budget = std::make_shared<CacheBudget>(1'200'000);
  Planner frugal({.cell_size_m = kCell, .budget = budget});
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult same, frugal.Plan(source, query, Stop()));
  EXPECT_EQ(same.waypoints, there.waypoints);
  EXPECT_EQ(same.cost, there.cost);
  EXPECT_LE(budget->cached_bytes(), 1'200'000U);
  EXPECT_EQ(frugal.cache_statistics().prepared, ample.cache_statistics().prepared);
  Planner poor({.cell_size_m = kCell, .budget = std::make_shared<CacheBudget>(20'000)});
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult none, poor.Plan(source, query, Stop()));
  EXPECT_EQ(none.reason, PlanReason::kSearchLimit);
  EXPECT_THAT(none.message, HasSubstr("shorter legs"));
}

TEST(PlannerTest, LimitsStopsAndFailuresAreAnswered) {
  MemoryTiles source(Terraces(0.0).Tiles());
  Planner planner({.cell_size_m = kCell});
  PlanQuery query = {.from = At(0.55, 0.55, 0), .to = At(3.45, 2.45, 0), .profile = SmallRobot()};
  query.max_expanded = 3;
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult limited, planner.Plan(source, query, Stop()));
  EXPECT_EQ(limited.reason, PlanReason::kSearchLimit);
  const Stop stop;
  stop.Request();
  EXPECT_THAT(planner.Plan(source, query, stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
  EXPECT_THAT(planner.Plan(source, query, Stop(absl::InfinitePast())),
              StatusIs(absl::StatusCode::kDeadlineExceeded, ::testing::_));
  query.from.x_m = std::nan("");
  EXPECT_THAT(planner.Plan(source, query, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("from")));
  query.from.x_m = 0.55;
  query.profile.radius_m = -1.0;
  EXPECT_THAT(planner.Plan(source, query, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("radius_m")));
  query.profile = SmallRobot();
  query.profile.max_gap_m = 10.0;
  query.profile.radius_m = 5.0;
  EXPECT_THAT(planner.Plan(source, query, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("cells")));
  MemoryTiles broken(Terraces(0.0).Tiles(2));
  broken.failure = absl::DataLossError("tile 0/0/0: checksum");
  query.profile = SmallRobot();
  EXPECT_THAT(planner.Plan(broken, query, Stop()),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("checksum")));
}

}  // namespace
}  // namespace strata
