// Whether a path holds: what was just planned does, and what stands in its way is found.
#include "core/planning/path_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/planning/planner.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/core/planning/small_robot.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::kCell;
using ::strata::testing::MemoryTiles;
using ::strata::testing::SmallRobot;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// 10 m × 4 m of level ground with its corner in the origin.
DrawnMap Ground() {
  DrawnMap map;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 100; ++x) map[{x, y}] = {{0.0}};
  }
  return map;
}

PathCheck CheckIn(const DrawnMap& map,
                  const std::vector<Eigen::Vector3d>& waypoints,
                  const ClassCosts& costs = {}) {
  MemoryTiles source(map.Tiles());
  Planner planner({.cell_size_m = kCell});
  absl::StatusOr<PathCheck> check = planner.Check(source, {waypoints, SmallRobot(), costs}, Stop());
  STRATA_EXPECT_OK(check);
  return check.ok() ? *std::move(check) : PathCheck();
}

// Not along cells' middles.
const std::vector<Eigen::Vector3d>& Across() {
  static const std::vector<Eigen::Vector3d> kPath = {
      {1.02, 2.03, 0.0}, {5.0, 2.4, 0.0}, {8.97, 1.71, 0.0}};
  return kPath;
}

TEST(PathCheckTest, LevelGroundHoldsAnyPathThatKeepsAwayFromItsBorder) {
  const PathCheck check = CheckIn(Ground(), Across());
  EXPECT_TRUE(check.valid) << check.message;
  EXPECT_NEAR(check.length_m, 8.03, 0.02);
  EXPECT_EQ(check.valid_m, check.length_m);
  EXPECT_FALSE(check.where.has_value());
  EXPECT_THAT(check.tiles, ElementsAre(TileKey{0, 0, 0}));
  EXPECT_TRUE(CheckIn(Ground(), {{5.0, 2.0, 0.0}}).valid);
  EXPECT_FALSE(CheckIn(Ground(), {{5.0, 2.0, 0.0}, {5.0, 3.9, 0.0}}).valid);
  EXPECT_FALSE(CheckIn(Ground(), {{5.0, 2.0, 0.0}, {15.0, 2.0, 0.0}}).valid);
}

TEST(PathCheckTest, AnObstacleIsFoundWhereItStands) {
  for (const bool back : {false, true}) {
    SCOPED_TRACE(back);
    DrawnMap map = Ground();
    for (int y = 22; y < 24; ++y) {
      for (int x = 60; x < 62; ++x) map[{x, y}] = {{0.6, 0.6}};
    }
    std::vector<Eigen::Vector3d> path = Across();
    if (back) std::reverse(path.begin(), path.end());
    const PathCheck check = CheckIn(map, path);
    EXPECT_FALSE(check.valid);
    ASSERT_TRUE(check.where.has_value());
    EXPECT_NEAR(check.where->x(), 6.1, 0.11);
    EXPECT_NEAR(check.where->y(), 2.3, 0.11);
    EXPECT_EQ(check.obstruction, Obstruction::kObstacle);
    EXPECT_NEAR(check.obstruction_value, 0.6, 1e-5);
    EXPECT_THAT(check.message, HasSubstr("obstacle of 0.60 m"));
    EXPECT_NEAR(check.valid_m, back ? 2.65 : 4.75, 0.2);
  }
}

TEST(PathCheckTest, AnObstacleBesideThePathCountsOnlyWithinTheRadius) {
  const auto valid = [](int y) {
    DrawnMap map = Ground();
    map[{50, y}] = {{0.6, 0.6}};
    return CheckIn(map, {{1.05, 2.05, 0.0}, {8.95, 2.05, 0.0}}).valid;
  };
  for (int y = 18; y <= 22; ++y) EXPECT_FALSE(valid(y)) << y;
  for (const int y : {16, 24}) EXPECT_TRUE(valid(y)) << y;
}

TEST(PathCheckTest, GroundThatIsGoneOrElsewhereIsFound) {
  DrawnMap sunk = Ground();
  for (int y = 0; y < 40; ++y) {
    for (int x = 40; x < 100; ++x) sunk[{x, y}] = {{-0.5}};
  }
  const PathCheck step = CheckIn(sunk, Across());
  EXPECT_FALSE(step.valid);
  EXPECT_NE(step.obstruction, Obstruction::kNone);
  EXPECT_NEAR(step.where->x(), 4.05, 0.16);
  DrawnMap raised = Ground();
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 100; ++x) raised[{x, y}] = {{0.4}};
  }
  const PathCheck above = CheckIn(raised, Across());
  EXPECT_FALSE(above.valid);
  EXPECT_EQ(above.valid_m, 0.0);
  EXPECT_NEAR(above.obstruction_value, 0.4, 1e-5);
  const PathCheck nothing = CheckIn(Ground(), {{-3.0, 1.0, 0.0}, {5.0, 2.0, 0.0}});
  EXPECT_FALSE(nothing.valid);
  EXPECT_EQ(nothing.obstruction, Obstruction::kUnknown);
}

TEST(PathCheckTest, PathsThatCannotBeAskedAboutAreRefused) {
  MemoryTiles source(Ground().Tiles());
  Planner planner({.cell_size_m = kCell});
  const auto check = [&](const std::vector<Eigen::Vector3d>& waypoints) {
    return planner.Check(source, {waypoints, SmallRobot()}, Stop()).status();
  };
  const auto kBad = absl::StatusCode::kInvalidArgument;
  EXPECT_THAT(check({}), StatusIs(kBad, HasSubstr("waypoints: 0")));
  EXPECT_THAT(check({{0, 0, 0}, {0, std::numeric_limits<double>::quiet_NaN(), 0}}),
              StatusIs(kBad, HasSubstr("waypoint 1")));
  EXPECT_THAT(check({{0, 0, 0}, {1e9, 0, 0}}), StatusIs(kBad, HasSubstr("map's range")));
  EXPECT_THAT(check({{0, 0, 0}, {1e6, 0, 0}}), StatusIs(kBad, HasSubstr("tiles")));
  EXPECT_THAT(check(std::vector<Eigen::Vector3d>(kMaxWaypoints + 1, {1, 1, 0})),
              StatusIs(kBad, HasSubstr("100001")));
  Stop stop;
  stop.Request();
  EXPECT_THAT(planner.Check(source, {Across(), SmallRobot()}, stop).status(),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

TEST(PathCheckTest, TilesAreThoseUnderTheLines) {
  const double tile_m = 256 * kCell;
  EXPECT_THAT(
      TilesUnder({{0.5 * tile_m, 0.5 * tile_m, 0.0}, {1.5 * tile_m, 1.9 * tile_m, 0.0}}, kCell),
      ElementsAre(TileKey{0, 0, 0}, TileKey{0, 0, 1}, TileKey{0, 1, 1}));
  EXPECT_THAT(TilesUnder({{-1.0, -1.0, 0.0}, {-1.0, -1.0, 4.0}}, kCell),
              ElementsAre(TileKey{0, -1, -1}));
  EXPECT_THAT(TilesUnder({{-1.0, 3.0, 0.0}, {tile_m + 1.0, 3.0, 0.0}}, kCell),
              ElementsAre(TileKey{0, -1, 0}, TileKey{0, 0, 0}, TileKey{0, 1, 0}));
}

}  // namespace
}  // namespace strata
