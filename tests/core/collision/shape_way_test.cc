// Shapes along ways over drawn maps, and a cylinder against the planner's own checks.
#include "core/collision/shape_way.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "core/planning/planner.h"
#include "core/planning/search_space.h"
#include "core/world/things/inferred_tile.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

constexpr double kCell = 0.1;

DrawnMap Ground(int nx, int ny) {
  DrawnMap map;
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) map[{x, y}].push_back({0.0});
  }
  return map;
}

absl::StatusOr<ShapeCheck> Check(const DrawnMap& map, const ShapeQuery& query) {
  MemoryTiles tiles(map.Tiles());
  return CheckShapeAlong(
      [&tiles](const TileKey& key) { return tiles.Load(key); }, kCell, query, Stop());
}

absl::StatusOr<ShapeCheck> CheckWithInferred(const DrawnMap& map,
                                             const std::vector<Vector3d>& points,
                                             const ShapeQuery& query) {
  MemoryTiles tiles(map.Tiles());
  InferredTileMaker maker(kCell);
  maker.Add(points);
  const InferredTileMap inferred = maker.Finish();
  return CheckShapeAlong([&tiles](const TileKey& key) { return tiles.Load(key); },
                         kCell,
                         query,
                         Stop(),
                         [&inferred](const TileKey& key) {
                           const auto found = inferred.find(key);
                           return found == inferred.end() ? nullptr : found->second;
                         });
}

// A cart of 1.2 m × 0.6 m × 1 m that goes from x = 1 to x = 9 in the middle of 10 m × 4 m.
ShapeQuery Cart() {
  ShapeQuery query;
  ShapePart part;
  part.size_m = {1.2, 0.6, 1.0};
  part.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, 0.5));
  query.shape.parts = {part};
  query.waypoints = {{1.0, 2.0, 0.0}, {9.0, 2.0, 0.0}};
  return query;
}

TEST(ShapeWayTest, OverLevelGroundItIsFree) {
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck check, Check(Ground(100, 40), Cart()));
  EXPECT_TRUE(check.free) << check.message;
  EXPECT_EQ(check.message, "free along 8.00 m");
  EXPECT_NEAR(check.length_m, 8.0, 1e-9);
  EXPECT_EQ(check.free_m, check.length_m);
  EXPECT_GE(check.looks, 8.0 / (kCell / 4));
}

TEST(ShapeWayTest, WhatWasInferredIsTouchedAndSaidToBe) {
  const DrawnMap map = Ground(100, 40);
  std::vector<Vector3d> post;
  for (double z = 0.0; z < 1.2; z += 0.05) post.emplace_back(5.02, 2.05, z);
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck check, CheckWithInferred(map, post, Cart()));
  EXPECT_FALSE(check.free);
  ASSERT_THAT(check.contacts, SizeIs(1));
  EXPECT_TRUE(check.contacts[0].inferred);
  EXPECT_FALSE(check.contacts[0].unknown);
  EXPECT_NEAR(check.contacts[0].from_m, 5.0 - 0.6 - 1.0, 0.05);
  EXPECT_NEAR(check.contacts[0].to_m, 5.1 + 0.6 - 1.0, 0.05);
  EXPECT_THAT(check.message, HasSubstr("touches something that was only inferred"));
  // What is over its head, and what is ground to it, is not.
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ShapeCheck over,
      CheckWithInferred(map, {{5.02, 2.05, 0.1}, {5.02, 2.05, 1.05}, {5.02, 2.6, 0.5}}, Cart()));
  EXPECT_TRUE(over.free) << over.message;
  // A measured post in the same place is measured.
  DrawnMap measured = map;
  measured[{50, 20}] = {{.z_m = 1.2, .depth_m = 1.2}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck both, CheckWithInferred(measured, post, Cart()));
  ASSERT_THAT(both.contacts, SizeIs(1));
  EXPECT_FALSE(both.contacts[0].inferred);
}

TEST(ShapeWayTest, APostIsTouchedWhereItStands) {
  DrawnMap map = Ground(100, 40);
  map[{50, 22}].push_back({0.8, 0.8});  // from y = 2.2 to 2.3: the cart reaches to 2.3
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck check, Check(map, Cart()));
  EXPECT_FALSE(check.free);
  ASSERT_THAT(check.contacts, SizeIs(1));
  const ShapeContact& contact = check.contacts[0];
  EXPECT_NEAR(contact.from_m, 5.0 - 1.0 - 0.6, kCell / 4 + 1e-6);
  EXPECT_NEAR(contact.to_m, 5.1 - 1.0 + 0.6, kCell / 4 + 1e-6);
  EXPECT_NEAR(contact.depth_m, 0.1, 0.01);
  EXPECT_NEAR(contact.where.x(), 5.05, 0.7);
  EXPECT_NEAR(contact.where.y(), 2.25, 0.1);
  EXPECT_EQ(check.free_m, contact.from_m);
  EXPECT_THAT(check.message, HasSubstr("touches something"));
}

TEST(ShapeWayTest, ClearanceIsKeptFromWhatIsBeside) {
  DrawnMap map = Ground(100, 40);
  map[{50, 24}].push_back({0.8, 0.8});  // 0.1 m beside the cart
  ShapeQuery query = Cart();
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck by, Check(map, query));
  EXPECT_TRUE(by.free) << by.message;
  query.clearance_m = 0.15;
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck close, Check(map, query));
  EXPECT_FALSE(close.free);
}

TEST(ShapeWayTest, ALoadThatReachesOverIsHeldAgainstWhatIsUp) {
  DrawnMap map = Ground(100, 40);
  map[{50, 35}].push_back({2.5, 0.4});  // 2.1 to 2.5 m up, 1.5 m aside
  ShapeQuery query = Cart();
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck without, Check(map, query));
  EXPECT_TRUE(without.free);
  ShapePart beam;
  beam.size_m = {0.2, 4.0, 0.2};
  beam.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, 2.3));
  query.shape.parts.push_back(beam);
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck with, Check(map, query));
  ASSERT_THAT(with.contacts, SizeIs(1));
  EXPECT_NEAR(with.contacts[0].from_m, 3.9, 0.05);
  EXPECT_NEAR(with.contacts[0].where.z(), 2.3, 0.25);
}

TEST(ShapeWayTest, TurningOnTheSpotIsSwept) {
  DrawnMap map = Ground(60, 60);
  map[{22, 23}].push_back({0.8, 0.8});  // beside neither leg, but within the cart's corners' reach
  ShapeQuery query = Cart();
  query.waypoints = {{1.0, 3.0, 0.0}, {2.8, 3.0, 0.0}, {2.8, 5.0, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck turn, Check(map, query));
  query.waypoints = {{1.0, 3.0, 0.0}, {2.8, 3.0, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck first, Check(map, query));
  EXPECT_TRUE(first.free) << first.message;
  query.waypoints = {{2.8, 3.0, 0.0}, {2.8, 5.0, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck second, Check(map, query));
  EXPECT_TRUE(second.free || !turn.free) << second.message;
  DrawnMap corner = Ground(60, 60);
  corner[{32, 25}].push_back({0.8, 0.8});
  query.waypoints = {{1.0, 3.0, 0.0}, {2.8, 3.0, 0.0}, {2.8, 1.0, 0.0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck swept, Check(corner, query));
  ASSERT_THAT(swept.contacts, SizeIs(1)) << swept.message;
  EXPECT_NEAR(swept.contacts[0].from_m, 1.8, 1e-6);
}

TEST(ShapeWayTest, OnARampItIsPitched) {
  DrawnMap map;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 100; ++x) map[{x, y}].push_back({0.3 * (x + 0.5) * kCell});
  }
  ShapeQuery query = Cart();
  query.waypoints = {{1.0, 2.0, 0.3}, {9.0, 2.0, 2.7}};
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck along, Check(map, query));
  EXPECT_TRUE(along.free) << along.message;
  query.waypoints.clear();
  query.poses = {Pose(Eigen::Translation3d(5.0, 2.0, 1.5))};  // upright, its front in the ramp
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck upright, Check(map, query));
  EXPECT_FALSE(upright.free);
}

TEST(ShapeWayTest, UnknownGroundIsInTheWayWhereThatIsAskedFor) {
  DrawnMap map = Ground(100, 40);
  for (int y = 10; y < 30; ++y) map.Erase({50, y});
  ShapeQuery query = Cart();
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck ignored, Check(map, query));
  EXPECT_TRUE(ignored.free);
  query.unknown_blocks = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const ShapeCheck blocked, Check(map, query));
  ASSERT_THAT(blocked.contacts, SizeIs(1)) << blocked.message;
  EXPECT_TRUE(blocked.contacts[0].unknown);
  EXPECT_EQ(blocked.contacts[0].depth_m, 0.0);
  EXPECT_NEAR(blocked.contacts[0].from_m, 3.4, 0.03);
  EXPECT_THAT(blocked.message, HasSubstr("unknown ground"));
}

// Upright round robots among posts: what stands within the radius is in the way of both.
TEST(ShapeWayTest, ACylinderIsThePlannersRobot) {
  constexpr unsigned kSeed = 9;
  std::mt19937 random(kSeed);
  RobotProfile profile;
  profile.radius_m = 0.37;  // no distance of middles to edges of cells
  DrawnMap map = Ground(200, 200);
  std::vector<CellIndex> posts;
  for (int i = 0; i < 150; ++i) {
    const int x = 5 + static_cast<int>(random() % 190);
    const int y = 5 + static_cast<int>(random() % 190);
    posts.push_back({x, y});
    map[{x, y}] = {{0.0}, {0.9, 0.9}};
  }
  MemoryTiles source(map.Tiles());
  Planner planner({.cell_size_m = kCell});
  STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks(profile, kCell));
  SearchSpace space(planner.cache(), source, checks);
  ShapeQuery query;
  ShapePart part;
  part.kind = ShapePart::Kind::kCylinder;
  part.size_m = {profile.radius_m, 0.0, profile.height_m};
  part.T_shape_part = Pose(Eigen::Translation3d(0.0, 0.0, profile.height_m / 2.0));
  query.shape.parts = {part};
  query.ground_m = profile.max_step_m;
  int free = 0, blocked = 0, close = 0;
  for (int i = 0; i < 4000; ++i) {
    const int x = 15 + static_cast<int>(random() % 170);
    const int y = 15 + static_cast<int>(random() % 170);
    const Eigen::Vector2d centre((x + 0.5) * kCell, (y + 0.5) * kCell);
    double nearest = 1e9;  // from the middle of the cell to a post's square
    for (const CellIndex& post : posts) {
      const Eigen::AlignedBox2d square(Eigen::Vector2d(post.x * kCell, post.y * kCell),
                                       Eigen::Vector2d((post.x + 1) * kCell, (post.y + 1) * kCell));
      nearest = std::min(nearest, square.exteriorDistance(centre));
    }
    query.poses = {Pose(Eigen::Translation3d(centre.x(), centre.y(), 0.0))};
    STRATA_ASSERT_OK_AND_ASSIGN(
        const ShapeCheck check,
        CheckShapeAlong(
            [&source](const TileKey& key) { return source.Load(key); }, kCell, query, Stop()));
    bool stands = false;
    for (const PatchId patch : space.FindCell({x, y})) {
      stands = stands || (space.Height(patch) < 0.1F && space.Danger(patch) >= 0.0F);
    }
    EXPECT_EQ(check.free, nearest > profile.radius_m) << nearest;
    // The planner sweeps to the cells beside, half a cell's diagonal farther.
    if (std::abs(nearest - profile.radius_m) < 0.71 * kCell) {
      ++close;
      continue;
    }
    EXPECT_EQ(check.free, stands) << nearest << " at " << x << ", " << y;
    ++(check.free ? free : blocked);
  }
  EXPECT_GT(free, 500);
  EXPECT_GT(blocked, 100);
  RecordProperty("close", close);
}

TEST(ShapeWayTest, WhatCannotBeCheckedSaysWhy) {
  const DrawnMap map = Ground(10, 10);
  const auto refused = [&](auto change) {
    ShapeQuery query = Cart();
    change(query);
    return Check(map, query).status();
  };
  const auto names = [](const char* what) {
    return StatusIs(Code::kInvalidArgument, HasSubstr(what));
  };
  EXPECT_THAT(refused([](ShapeQuery& q) { q.shape.parts.clear(); }), names("neither triangles"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.waypoints.clear(); }), names("poses or waypoints"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.waypoints[0].x() = std::nan(""); }),
              names("waypoint 0"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.clearance_m = -1.0; }), names("clearance_m"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.shape.parts[0].size_m.x() = 0.0; }), names("part 0"));
  EXPECT_THAT(refused([](ShapeQuery& q) {
                q.shape.vertices = {{2000.0F, 0.0F, 0.0F}};
              }),
              names("millimetres"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.shape.triangles = {{0, 1, 2}}; }), names("no vertex"));
  EXPECT_THAT(refused([](ShapeQuery& q) { q.waypoints[1].x() = 1e6; }), names("in parts"));
  ShapeQuery query = Cart();
  const Stop stop;
  stop.Request();
  MemoryTiles tiles(map.Tiles());
  EXPECT_EQ(
      CheckShapeAlong([&tiles](const TileKey& key) { return tiles.Load(key); }, kCell, query, stop)
          .status()
          .code(),
      Code::kCancelled);
}

}  // namespace
}  // namespace strata
