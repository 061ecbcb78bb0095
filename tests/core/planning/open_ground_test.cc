// Ground that goes on, on an upper floor with holes that no beam fell through.
#include "core/planning/open_ground.h"

#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/field_of_view.h"
#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;
using ::testing::IsEmpty;

constexpr double kCell = 0.1;
const Vector3d kSensor(2.0, 2.0, 4.0);

// A floor at 0 m and one at 3 m above it, 4 m wide: whole to x = 4, of every third cell to x = 6.
DrawnMap TwoFloors() {
  DrawnMap map;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 100; ++x) {
      map[{x, y}].push_back({0.0});
      if (x < 40 || (x < 60 && x % 3 == 0 && y % 3 == 0)) map[{x, y}].push_back({3.0});
    }
  }
  return map;
}

// Rays from kSensor to every place of the plane z with x in [from_m, to_m].
PointCloud RaysTo(double z, double from_m, double to_m) {
  PointCloud cloud;
  for (double x = from_m; x < to_m; x += 0.04) {
    for (double y = 0.02; y < 4.0; y += 0.04) {
      cloud.points.push_back((Vector3d(x, y, z) - kSensor).cast<float>());
    }
  }
  return cloud;
}

// Around where a robot can stand on the upper floor, of which rays to `seen_m` ended there.
std::vector<Vector3d> OpenAround(double seen_m, const std::vector<Pose>& looks, int rows) {
  MemoryTiles source(TwoFloors().Tiles());
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
  const ProfileChecks checks = MakeProfileChecks({}, kCell).value();
  SearchSpace space(cache, source, checks);
  std::vector<PatchId> reached;
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 40; ++y) reached.push_back(space.FindCell({x, y}).back());
  }
  SeenSpace seen{OccupancyVoxels({}), looks};
  const Pose T_map_sensor{Eigen::Translation3d(kSensor)};
  STRATA_EXPECT_OK(seen.voxels.Add(RaysTo(2.99, 0.0, seen_m), T_map_sensor, {}, Stop()));
  if (seen_m < 6.0) {
    STRATA_EXPECT_OK(seen.voxels.Add(RaysTo(-0.01, 6.5, 20.0), T_map_sensor, {}, Stop()));
  }
  FieldOfView sensor;
  sensor.down_rad = 1.5;
  sensor.rows = rows;
  return OpenGround(space, reached, seen, sensor);
}

TEST(OpenGroundTest, CellsBetweenSurfacesThatBeamsDrewAreOpen) {
  const std::vector<Vector3d> open = OpenAround(6.2, {}, 32);
  EXPECT_GT(open.size(), 200U);
  for (const Vector3d& place : open) {
    EXPECT_NEAR(place.z(), 3.0, 0.01);
    EXPECT_GT(place.x(), 4.0);
    EXPECT_LT(place.x(), 6.5);
  }
}

// The robot cannot stand there for the cells between them.
TEST(OpenGroundTest, SurfacesBesideOpenCellsAreOpenToo) {
  int surfaces = 0;
  for (const Vector3d& place : OpenAround(6.2, {}, 32)) {
    const Eigen::Vector2i cell = (place.head<2>() / kCell).array().floor().cast<int>();
    if (cell.x() < 60 && cell.x() % 3 == 0 && cell.y() % 3 == 0) ++surfaces;
  }
  EXPECT_GT(surfaces, 40);  // of 98
}

// Where rays went to the floor below there is no ground, and nothing to look at.
TEST(OpenGroundTest, WhereRaysWentThroughIsADrop) {
  for (const Vector3d& place : OpenAround(4.2, {}, 32)) EXPECT_LT(place.x(), 4.6);
}

TEST(OpenGroundTest, WhatALookHadABeamForEachCellOfIsNot) {
  const Pose look{Eigen::Translation3d(kSensor)};
  EXPECT_THAT(OpenAround(6.2, {look}, 1000), IsEmpty());
  EXPECT_FALSE(OpenAround(6.2, {look}, 8).empty());
}

}  // namespace
}  // namespace strata
