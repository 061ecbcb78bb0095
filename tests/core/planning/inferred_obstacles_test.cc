// Robots kept out of what was inferred.
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "core/world/plan.h"
#include "core/world/things/inferred_tile.h"
#include "tests/core/planning/small_robot.h"
#include "tests/support/drawing.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::At;
using ::strata::testing::DrawnMap;
using ::strata::testing::kCell;
using ::strata::testing::MapFromDrawing;
using ::strata::testing::MemoryTiles;
using ::strata::testing::SmallRobot;
using ::testing::HasSubstr;

// Tiles of a drawn map, and what was inferred there.
class TilesWithInferred final : public MemoryTiles {
 public:
  TilesWithInferred(const DrawnMap& map, const std::vector<Vector3d>& points)
      : MemoryTiles(map.Tiles()) {
    Infer(points);
  }
  void Infer(const std::vector<Vector3d>& points) {
    InferredTileMaker maker(kCell);
    maker.Add(points);
    inferred_ = maker.Finish();
  }
  std::shared_ptr<const InferredTile> Inferred(const TileKey& key) override {
    const auto found = inferred_.find(key);
    return found == inferred_.end() ? nullptr : found->second;
  }

 private:
  InferredTileMap inferred_;
};

// A place every 5 cm of a box's inside and sides.
std::vector<Vector3d> Block(const Vector3d& low, const Vector3d& high) {
  std::vector<Vector3d> points;
  for (double x = low.x() + 0.025; x < high.x(); x += 0.05) {
    for (double y = low.y() + 0.025; y < high.y(); y += 0.05) {
      for (double z = low.z() + 0.025; z < high.z(); z += 0.05) points.emplace_back(x, y, z);
    }
  }
  return points;
}

PlanResult Plan(const DrawnMap& map, const std::vector<Vector3d>& points, const PlanQuery& query) {
  TilesWithInferred source(map, points);
  Planner planner({.cell_size_m = kCell});
  absl::StatusOr<PlanResult> result = planner.Plan(source, query, Stop());
  STRATA_EXPECT_OK(result);
  return result.ok() ? *std::move(result) : PlanResult();
}

// 24 m × 10 m at 0, a deck over the half of it at 3 m, both with holes of one cell; over the corner
// of four tiles.
DrawnMap TwoLevels(std::mt19937& random) {
  std::bernoulli_distribution hole(0.01);
  DrawnMap map;
  for (int y = -50; y < 50; ++y) {
    for (int x = -120; x < 120; ++x) {
      if (!hole(random)) map[{x, y}].push_back({.z_m = 0.0});
      if (y >= 0 && !hole(random)) map[{x, y}].push_back({.z_m = 3.0, .depth_m = 0.3});
    }
  }
  return map;
}

std::vector<Vector3d> Scattered(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> x(-12.0, 12.0);
  std::uniform_real_distribution<double> y(-5.0, 5.0);
  std::uniform_real_distribution<double> z(-1.0, 5.0);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(x(random), y(random), z(random));
  return points;
}

// By the points alone: one within the robot's disc, higher than its step and lower than its head.
bool Meets(const std::vector<Vector3d>& points, const Vector3d& stands, const RobotProfile& robot) {
  // What the disc sweeps on the way to the next cell.
  const double disc_m = std::hypot(robot.radius_m, std::hypot(0.5, 0.5) * kCell);
  for (const Vector3d& p : points) {
    const double up = p.z() - stands.z();
    if (up <= robot.max_step_m || up >= robot.height_m) continue;
    double square = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      const double low = std::floor(p[axis] / kCell) * kCell;  // the whole cell is taken
      const double off = std::max({0.0, low - stands[axis], stands[axis] - low - kCell});
      square += off * off;
    }
    if (std::sqrt(square) < disc_m) return true;
  }
  return false;
}

TEST(InferredObstaclesTest, WhereARobotCannotStandIsWhereItsBodyMeetsAPoint) {
  RobotProfile robot = SmallRobot();
  robot.radius_m = 0.23;  // no cell touches the disc's border
  const ProfileChecks checks = MakeProfileChecks(robot, kCell).value();
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const DrawnMap map = TwoLevels(random);
    const std::vector<Vector3d> points = Scattered(random, 400);
    MemoryTiles plain(map.Tiles());
    TilesWithInferred with(map, points);
    TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
    SearchSpace free(cache, plain, checks);
    SearchSpace space(cache, with, checks);
    int blocked = 0;
    int standing = 0;
    for (const auto& [cell, surfaces] : map.columns()) {
      const SearchSpace::Column before = free.FindCell(cell);
      const SearchSpace::Column after = space.FindCell(cell);
      ASSERT_EQ(before.size(), surfaces.size());
      ASSERT_EQ(after.size(), surfaces.size());
      for (std::size_t i = 0; i < after.size(); ++i) {
        const bool could = free.Danger(before[i]) >= 0.0F;
        const bool can = space.Danger(after[i]) >= 0.0F;
        const bool meets = Meets(points, space.Position(after[i]), robot);
        ASSERT_EQ(can, could && !meets)
            << "seed " << seed << " at " << space.Position(after[i]).transpose();
        blocked += could && !can ? 1 : 0;
        standing += can ? 1 : 0;
      }
    }
    EXPECT_GT(blocked, 1000);
    EXPECT_GT(standing, 1000);
  }
}

TEST(InferredObstaclesTest, AWayGoesThroughWhatIsIgnoredAndRoundWhatIsAnObstacle) {
  const DrawnMap map = MapFromDrawing("..........\n..........\n..........", {{'.', {{0.0}}}}, 10);
  const std::vector<Vector3d> car = Block({4.0, 0.0, 0.0}, {6.0, 1.8, 1.4});
  const PlanQuery query = {
      .from = At(1.05, 0.85, 0), .to = At(9.05, 0.85, 0), .profile = SmallRobot()};
  const PlanResult through = Plan(map, {}, query);
  ASSERT_TRUE(through.found()) << through.message;
  EXPECT_NEAR(through.length_m, 8.0, 0.1);
  const PlanResult around = Plan(map, car, query);
  ASSERT_TRUE(around.found()) << around.message;
  EXPECT_GT(around.length_m, 8.5);
  TilesWithInferred source(map, car);
  Planner planner({.cell_size_m = kCell});
  const auto check = [&](const PlanResult& plan) {
    return planner.Check(source, {plan.waypoints, query.profile}, Stop()).value();
  };
  EXPECT_TRUE(check(around).valid) << check(around).message;
  const PathCheck refused = check(through);
  EXPECT_FALSE(refused.valid);
  EXPECT_TRUE(refused.inferred);
  EXPECT_EQ(refused.obstruction, Obstruction::kObstacle);
  EXPECT_THAT(refused.message, HasSubstr("inferred obstacle of 1.3"));
  EXPECT_NEAR(refused.valid_m, 4.0 - 1.05 - query.profile.radius_m, 0.2);
}

TEST(InferredObstaclesTest, ABlockedWaySaysThatNobodyMeasuredWhatIsThere) {
  const DrawnMap map = MapFromDrawing("..........", {{'.', {{0.0}}}}, 10);
  const PlanQuery query = {
      .from = At(1.05, 0.55, 0), .to = At(9.05, 0.55, 0), .profile = SmallRobot()};
  const PlanResult wall = Plan(map, Block({5.0, 0.0, 0.0}, {5.2, 1.0, 2.0}), query);
  EXPECT_EQ(wall.reason, PlanReason::kBlocked);
  EXPECT_TRUE(wall.inferred);
  EXPECT_THAT(wall.message, HasSubstr("blocked by inferred obstacle of 1.9"));
  ASSERT_TRUE(wall.where.has_value());
  EXPECT_NEAR(wall.where->x(), 5.05, 0.2);
  // What hangs is a want of clearance; what is as high as a step, and what is over its head, none.
  const PlanResult beam = Plan(map, Block({5.0, 0.0, 0.5}, {5.2, 1.0, 0.7}), query);
  EXPECT_EQ(beam.obstruction, Obstruction::kClearance) << beam.message;
  EXPECT_TRUE(beam.inferred);
  EXPECT_NEAR(beam.obstruction_value, 0.525, 0.01);
  EXPECT_TRUE(Plan(map, Block({5.0, 0.0, 0.0}, {5.2, 1.0, 0.15}), query).found());
  EXPECT_TRUE(Plan(map, Block({5.0, 0.0, 1.0}, {5.2, 1.0, 1.5}), query).found());
  // On it nobody stands, however level it is.
  const PlanResult onto =
      Plan(map,
           Block({4.0, 0.0, 0.0}, {6.0, 1.0, 0.6}),
           {.from = query.from, .to = At(5.05, 0.55, 0.6), .profile = SmallRobot()});
  EXPECT_FALSE(onto.found());
  EXPECT_TRUE(onto.inferred) << onto.message;
  // Where something was measured that is told.
  DrawnMap measured = map;
  for (int y = 0; y < 10; ++y) measured[{50, y}] = {{.z_m = 2.0, .depth_m = 2.0}};
  const PlanResult both = Plan(measured, Block({5.0, 0.0, 0.0}, {5.1, 1.0, 2.0}), query);
  EXPECT_EQ(both.reason, PlanReason::kBlocked);
  EXPECT_FALSE(both.inferred) << both.message;
}

TEST(InferredObstaclesTest, AGapWithSomethingInItIsNotBridged) {
  DrawnMap map;
  for (int x = 0; x < 100; ++x) {
    for (int y = 0; y < 10; ++y) {
      if (x < 50 || x > 52) map[{x, y}] = {{.z_m = 0.0}};
    }
  }
  const PlanQuery query = {
      .from = At(1.05, 0.55, 0), .to = At(9.05, 0.55, 0), .profile = SmallRobot()};
  EXPECT_EQ(Plan(map, {}, query).gaps.size(), 1U);
  const PlanResult gap = Plan(map, Block({5.1, 0.0, 0.2}, {5.2, 1.0, 1.0}), query);
  EXPECT_FALSE(gap.found());
  EXPECT_TRUE(gap.inferred) << gap.message;
}

TEST(InferredObstaclesTest, TilesArePreparedAnewWhereItChangedAndNowhereElse) {
  const DrawnMap map = MapFromDrawing("....................................",
                                      {{'.', {{0.0}}}},
                                      16);  // three tiles from west to east
  TilesWithInferred source(map, Block({1.0, 0.4, 0.0}, {1.4, 1.0, 1.0}));
  MemoryTiles plain(map.Tiles());
  const ProfileChecks checks = MakeProfileChecks(SmallRobot(), kCell).value();
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
  const auto get = [&](TileSource& from) {
    for (int x = 0; x < 3; ++x) STRATA_EXPECT_OK(cache.Get(from, {0, x, 0}, checks).status());
    return cache.statistics().prepared;
  };
  EXPECT_EQ(get(plain), 3U);
  EXPECT_EQ(get(source), 5U);  // the tile and its neighbour; the third is far off
  // Whoever ignores it and whoever does not do not take each other's place.
  EXPECT_EQ(get(plain), 5U);
  EXPECT_EQ(get(source), 5U);
  source.Infer(Block({1.0, 0.4, 0.0}, {1.4, 1.0, 1.2}));
  EXPECT_EQ(get(source), 7U);
  source.Infer({});
  EXPECT_EQ(get(source), 7U);
}

}  // namespace
}  // namespace strata
