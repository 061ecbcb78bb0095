#include "core/mls/elevation/elevation_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/build.h"
#include "core/mls/mls_map.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
// σ = 0.1 m at range 0, growing by 0.1 m a metre.
const SensorModel kSensor = {.sigma_m = 0.1, .sigma_per_metre = 0.1, .max_range_m = 50.0};

PointCloud CloudOf(std::vector<Eigen::Vector3f> points) {
  PointCloud cloud;
  cloud.points = std::move(points);
  return cloud;
}

TEST(ElevationMapTest, HighestMeasurementWinsWithItsSigma) {
  const PointCloud cloud = CloudOf({{0.5F, 0.5F, 1.0F}, {0.6F, 0.5F, 3.0F}, {0.5F, 0.6F, 2.0F}});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap map,
      InsertForward(cloud, Pose::Identity(), kSensor, 1.0, ElevationRule::kHighest));
  EXPECT_EQ(map.observed_count(), 1U);
  EXPECT_FLOAT_EQ(map.At({0, 0}).z_m, 3.0F);
  EXPECT_NEAR(map.At({0, 0}).sigma_m, 0.1 + 0.1 * std::sqrt(0.36 + 0.25 + 9.0), 1e-6);
  EXPECT_FALSE(map.At({-5, 7}).observed());
}

TEST(ElevationMapTest, KalmanVariantIsTheRepeatedUpdateOfTheThesis) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-3.0F, 3.0F);
  std::vector<Eigen::Vector3f> points(2000);
  for (Eigen::Vector3f& p : points) p = {place(random), place(random), place(random)};
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap map,
      InsertForward(CloudOf(points), Pose::Identity(), kSensor, 0.5, ElevationRule::kKalman));
  struct State {
    double mean, variance;
  };
  std::map<CellIndex, State> oracle;  // 6.1 and 6.2 one measurement at a time
  for (const Eigen::Vector3f& p : points) {
    const double sigma = kSensor.SigmaAt(p.cast<double>().norm());
    const double r = sigma * sigma;
    const CellIndex cell = {static_cast<int>(std::floor(p.x() / 0.5)),
                            static_cast<int>(std::floor(p.y() / 0.5))};
    const auto [it, first] = oracle.try_emplace(cell, State{p.z(), r});
    if (first) continue;
    State& s = it->second;
    s = {(r * s.mean + s.variance * p.z()) / (s.variance + r), s.variance * r / (s.variance + r)};
  }
  EXPECT_EQ(map.observed_count(), oracle.size());
  for (const auto& [cell, state] : oracle) {
    EXPECT_NEAR(map.At(cell).z_m, state.mean, 1e-5);
    EXPECT_NEAR(map.At(cell).sigma_m, std::sqrt(state.variance), 1e-6);
  }
}

TEST(ElevationMapTest, PoseOriginAndSensorRangeAreMinded) {
  PointCloud cloud = CloudOf({{1.0F, 0.0F, 0.0F}, {60.0F, 0.0F, 0.0F}, {-0.25F, 0.0F, 0.0F}});
  cloud.origin = {5e6, 0.0, 0.0};
  SensorModel sensor = kSensor;
  sensor.min_range_m = 0.5;
  Pose T_map_scan = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0.5, 0.0, 7.0});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap map,
      InsertForward(cloud, T_map_scan, sensor, 1.0, ElevationRule::kHighest));
  EXPECT_EQ(map.observed_count(), 1U);
  EXPECT_FLOAT_EQ(map.At({0, 5000001}).z_m, 7.0F);
}

TEST(ElevationMapTest, BadInputIsRefused) {
  const auto forward = [](const PointCloud& cloud, double cell_size_m) {
    return InsertForward(cloud, Pose::Identity(), kSensor, cell_size_m, ElevationRule::kHighest)
        .status();
  };
  EXPECT_THAT(forward(CloudOf({{0, 0, kNan}}), 1.0),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("point 0")));
  EXPECT_THAT(forward(CloudOf({}), 0.0),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("cell_size_m = 0")));
  EXPECT_THAT(forward(CloudOf({{-40, -20, 0}, {0, 20, 0}, {30, 0, 0}}), 0.01), testing::IsOk());
  SensorModel far = kSensor;
  far.max_range_m = 1e6;
  EXPECT_THAT(InsertForward(CloudOf({{-9e4F, 0, 0}, {0, 9e4F, 0}}),
                            Pose::Identity(),
                            far,
                            0.1,
                            ElevationRule::kHighest),
              StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("larger cells")));
  EXPECT_THAT(InterpolateBackward(CloudOf({{0, 0, 0}}), Pose::Identity(), kSensor, 1.0),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("organised")));
  PointCloud organised = CloudOf({{0, 0, 0}});
  organised.rows = organised.columns = 1;
  EXPECT_THAT(
      InterpolateBackward(organised, Pose::Identity(), kSensor, 1.0, {.max_range_ratio = 1}),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("max_range_ratio")));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap empty,
      InsertForward(CloudOf({}), Pose::Identity(), kSensor, 1.0, ElevationRule::kKalman));
  EXPECT_EQ(empty.observed_count(), 0U);
}

// A scan by a sensor 2 m above height(x, y) = tilt · x with a box of 1 m in front.
struct Scene {
  double tilt = 0.0;
  bool box = false;
};

// Casts one ray from (0, 0, 2): nearest hit with the ground z = tilt·x and the box 4 ≤ x ≤ 6,
// |y| ≤ 1, z ≤ 1.
Eigen::Vector3f Cast(const Scene& scene, double azimuth, double elevation) {
  const Eigen::Vector3d d(std::cos(elevation) * std::cos(azimuth),
                          std::cos(elevation) * std::sin(azimuth),
                          std::sin(elevation));
  double best = 45.0;
  const double ground = -2.0 / (d.z() - scene.tilt * d.x());
  if (ground > 0.0) best = std::min(best, ground);
  const auto try_hit = [&](double s, double x0, double x1, double z0, double z1) {
    const Eigen::Vector3d p = Eigen::Vector3d(0, 0, 2) + s * d;
    const bool inside = p.x() >= x0 - 1e-9 && p.x() <= x1 + 1e-9 && std::abs(p.y()) <= 1.0 &&
                        p.z() >= z0 - 1e-9 && p.z() <= z1 + 1e-9;
    if (s > 0.0 && inside) best = std::min(best, s);
  };
  if (scene.box) {
    try_hit(4.0 / d.x(), 4.0, 4.0, -1.0, 1.0);
    try_hit(-1.0 / d.z(), 4.0, 6.0, 1.0, 1.0);
  }
  if (best >= 45.0) return {kNan, kNan, kNan};
  return (Eigen::Vector3d(0, 0, 2) + best * d).cast<float>();
}

PointCloud Scan(const Scene& scene) {
  PointCloud cloud;
  cloud.sensor_origin = {0.0F, 0.0F, 2.0F};
  cloud.rows = 60;
  cloud.columns = 120;
  for (int row = 0; row < 60; ++row) {
    for (int column = 0; column < 120; ++column) {
      cloud.points.push_back(Cast(scene, 0.012 * (column - 60), 0.2 - 0.012 * row));
    }
  }
  return cloud;
}

TEST(ElevationMapTest, BackwardInterpolationOfAPlaneIsThatPlaneAtAnyResolution) {
  for (const double cell : {0.5, 0.1, 0.03}) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        const ElevationMap map,
        InterpolateBackward(Scan({.tilt = 0.05}), Pose::Identity(), kSensor, cell));
    std::size_t near = 0;
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const ElevationCell& c = map.cells[static_cast<std::size_t>(y) * map.width + x];
        if (!c.observed()) continue;
        const double middle = (map.corner.x + x + 0.5) * cell;
        EXPECT_NEAR(c.z_m, 0.05 * middle, 2e-5);
        EXPECT_GT(c.sigma_m, 0.0F);
        const double y_middle = (map.corner.y + y + 0.5) * cell;
        near += middle > 4.5 && middle < 6.0 && std::abs(y_middle) < 2.0;
      }
    }
    // No holes where the image covers the ground, however fine the cells.
    EXPECT_NEAR(static_cast<double>(near) * cell * cell, 1.5 * 4.0, 0.25 * 4.0 * cell * 8);
  }
}

TEST(ElevationMapTest, ForwardInsertionHasHolesWhereBackwardHasNone) {
  const PointCloud cloud = Scan({});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap forward,
      InsertForward(cloud, Pose::Identity(), kSensor, 0.05, ElevationRule::kHighest));
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap backward,
                              InterpolateBackward(cloud, Pose::Identity(), kSensor, 0.05));
  EXPECT_GT(backward.observed_count(), 3 * forward.observed_count());
}

TEST(ElevationMapTest, BackwardInterpolationLeavesTheShadowOfABoxOpen) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap map,
      InterpolateBackward(Scan({.box = true}), Pose::Identity(), kSensor, 0.1));
  EXPECT_NEAR(map.At({50, 0}).z_m, 1.0, 1e-5);   // on the box
  EXPECT_NEAR(map.At({35, 0}).z_m, 0.0, 1e-5);   // in front of it
  EXPECT_FALSE(map.At({90, 0}).observed());      // behind it, hidden up to x = 12
  EXPECT_NEAR(map.At({130, 0}).z_m, 0.0, 1e-4);  // beyond the shadow
  EXPECT_NEAR(map.At({90, 40}).z_m, 0.0, 1e-4);  // beside it
}

TEST(ElevationMapTest, TilesHoldTheObservedCells) {
  PointCloud cloud = CloudOf({{-0.5F, 0.5F, 1.0F}, {0.5F, 0.5F, 2.0F}, {2.5F, 1.5F, 3.0F}});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap map,
      InsertForward(cloud, Pose::Identity(), kSensor, 1.0, ElevationRule::kHighest));
  const std::vector<SurfaceTile> tiles = SurfacesOf(map);
  ASSERT_EQ(tiles.size(), 2U);
  EXPECT_EQ(tiles[0].key, (TileKey{0, -1, 0}));
  EXPECT_EQ(tiles[0].Cell(CellInTile({-1, 0})).size(), 1U);
  ASSERT_EQ(tiles[1].Cell(CellInTile({2, 1})).size(), 1U);
  EXPECT_FLOAT_EQ(tiles[1].Cell(CellInTile({2, 1}))[0].z_m, 3.0F);
}

// Three levels in one cell, one of them a wall, and a cell of one level.
std::vector<SurfaceTile> Levels() {
  SurfaceTile tile;
  tile.key = TileOfCell({-1, 5});
  const std::uint16_t column = CellInTile({-1, 5});
  tile.surfaces = {{.cell = column, .z_m = 0.5F, .sigma_m = 0.01F},
                   {.cell = column, .z_m = 2.0F, .sigma_m = 0.02F, .depth_m = 0.7F},
                   {.cell = column, .z_m = 4.0F, .sigma_m = 0.05F},
                   {.cell = CellInTile({-1, 7}), .z_m = -1.0F, .sigma_m = 0.03F}};
  tile.IndexRows();
  return {tile};
}

TEST(ElevationOfTest, HighestOrAllFused) {
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap highest,
                              ElevationOf(Levels(), 0.2, ElevationRule::kHighest));
  EXPECT_EQ(highest.corner, (CellIndex{-1, 5}));
  EXPECT_EQ(highest.width, 1);
  EXPECT_EQ(highest.height, 3);
  EXPECT_EQ(highest.At({-1, 5}), (ElevationCell{4.0F, 0.05F}));
  EXPECT_FALSE(highest.At({-1, 6}).observed());
  EXPECT_EQ(highest.At({-1, 7}), (ElevationCell{-1.0F, 0.03F}));
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap fused,
                              ElevationOf(Levels(), 0.2, ElevationRule::kKalman));
  double mean = 0.5, variance = 1e-4;  // 6.1 and 6.2, one after the other
  for (const auto& [z, s] : {std::pair(2.0, 0.02), std::pair(4.0, 0.05)}) {
    mean = (s * s * mean + variance * z) / (variance + s * s);
    variance = variance * s * s / (variance + s * s);
  }
  EXPECT_NEAR(fused.At({-1, 5}).z_m, mean, 1e-6);
  EXPECT_NEAR(fused.At({-1, 5}).sigma_m, std::sqrt(variance), 1e-7);
  EXPECT_EQ(fused.At({-1, 7}), (ElevationCell{-1.0F, 0.03F}));
}

// What a map's tiles say and what its points say, on bumpy ground without walls.
TEST(ElevationOfTest, FusedSurfacesAreThePointsFused) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-3.0F, 3.0F);
  std::normal_distribution<float> noise(0.0F, 0.005F);
  std::vector<Eigen::Vector3f> points(20'000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float level = i % 3 == 0 ? 2.5F : 0.0F;
    points[i] = {place(random), place(random), level + noise(random)};
  }
  const PointCloud cloud = CloudOf(points);
  const SensorModel sensor = {.sigma_m = 0.01, .sigma_per_metre = 0.01};
  STRATA_ASSERT_OK_AND_ASSIGN(const MlsBuildResult built,
                              BuildMlsMap(cloud, Pose::Identity(), sensor, {.cell_size_m = 0.5}));
  std::vector<SurfaceTile> tiles;
  for (const MlsTile& tile : built.map.tiles) tiles.push_back(SurfacesOf(tile));
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap from_tiles,
                              ElevationOf(tiles, 0.5, ElevationRule::kKalman));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ElevationMap from_points,
      InsertForward(cloud, Pose::Identity(), sensor, 0.5, ElevationRule::kKalman));
  ASSERT_EQ(from_tiles.width, from_points.width);
  ASSERT_EQ(from_tiles.height, from_points.height);
  for (std::size_t i = 0; i < from_points.cells.size(); ++i) {
    // σ is coded in steps of 2.2 %, which moves weights between the levels.
    EXPECT_NEAR(from_tiles.cells[i].z_m, from_points.cells[i].z_m, 0.02);
    EXPECT_NEAR(from_tiles.cells[i].sigma_m,
                from_points.cells[i].sigma_m,
                0.012 * from_points.cells[i].sigma_m);
  }
}

TEST(ElevationOfTest, OnlyTheRegionAndNothingOfNothing) {
  const ElevationRegion region(Eigen::Vector2d(-1.0, 1.3), Eigen::Vector2d(1.0, 9.0));
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap part,
                              ElevationOf(Levels(), 0.2, ElevationRule::kHighest, region));
  EXPECT_EQ(part.observed_count(), 1U);
  EXPECT_EQ(part.corner, (CellIndex{-1, 7}));
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap none,
                              ElevationOf({}, 0.2, ElevationRule::kKalman));
  EXPECT_TRUE(none.cells.empty());
}

TEST(ElevationOfTest, WhatIsTooFarApartIsRefused) {
  std::vector<SurfaceTile> tiles = Levels();
  tiles.push_back(tiles.front());
  tiles.back().key.x += 100;
  tiles.back().key.y += 100;
  EXPECT_THAT(ElevationOf(tiles, 0.2, ElevationRule::kHighest),
              StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("smaller region")));
}

}  // namespace
}  // namespace strata
