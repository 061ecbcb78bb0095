#include "core/mls/build.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/mls/reference_map.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::RandomPose;
using ::strata::testing::ReferenceMap;
using ::strata::testing::StatusIs;
using ::strata::testing::Uniform;
using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Ground, walls and canopies in a box of ±`extent_m`, dense enough that cells hold many heights.
PointCloud RandomCloud(std::mt19937_64& random, std::size_t points, double extent_m) {
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const double kind = Uniform(random, 0, 1);
    const double z = kind < 0.5   ? Uniform(random, -0.02, 0.02)
                     : kind < 0.7 ? Uniform(random, -3, 5)
                                  : std::floor(Uniform(random, 0, 4)) + Uniform(random, 0, 0.12);
    cloud.points.emplace_back(static_cast<float>(Uniform(random, -extent_m, extent_m)),
                              static_cast<float>(Uniform(random, -extent_m, extent_m)),
                              static_cast<float>(z));
  }
  return cloud;
}

void AddColumns(std::mt19937_64& random, PointCloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint64_t bits = random();
    cloud.colour.push_back({static_cast<std::uint8_t>(bits),
                            static_cast<std::uint8_t>(bits >> 8),
                            static_cast<std::uint8_t>(bits >> 16)});
    cloud.label.push_back(static_cast<std::uint16_t>((bits >> 24) % 4));
  }
}

MlsMap Build(const PointCloud& cloud,
             const Pose& T_map_scan = Pose::Identity(),
             const SensorModel& sensor = {},
             const MlsParameters& parameters = {}) {
  auto result = BuildMlsMap(cloud, T_map_scan, sensor, parameters);
  EXPECT_THAT(result, testing::IsOk());
  return result.ok() ? result->map : MlsMap{};
}

TEST(BuildMlsMapTest, EqualsTheReferenceByteForByte) {
  MlsScratch scratch;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const double extent = std::pow(10.0, Uniform(random, -0.5, 2.5));
    PointCloud cloud = RandomCloud(random, 1 + random() % 6000, extent);
    if (seed % 3 == 0) AddColumns(random, cloud);
    cloud.sensor_origin = {static_cast<float>(Uniform(random, -5, 5)), 1.0F, 0.5F};
    if (seed % 4 == 0) cloud.origin = {4e5, 5.4e6, 120};
    const Pose T_map_scan = seed % 5 == 0 ? Pose::Identity() : RandomPose(random, 1000);
    const SensorModel sensor{.sigma_m = Uniform(random, 0.0005, 0.05),
                             .sigma_per_metre = Uniform(random, 0, 0.01),
                             .min_range_m = Uniform(random, 0, 1),
                             .max_range_m = Uniform(random, 20, 300)};
    const MlsParameters parameters{.cell_size_m = Uniform(random, 0.05, 1),
                                   .gap_size_m = Uniform(random, 0.05, 2),
                                   .thickness_m = Uniform(random, 0.01, 1)};
    STRATA_ASSERT_OK_AND_ASSIGN(const MlsBuildResult result,
                                BuildMlsMap(cloud, T_map_scan, sensor, parameters, scratch));
    const MlsMap reference = ReferenceMap(cloud, T_map_scan, sensor, parameters);
    ASSERT_EQ(result.map.patch_count(), reference.patch_count());
    ASSERT_TRUE(result.map == reference);
  }
}

TEST(BuildMlsMapTest, OrderOfPointsDoesNotMatter) {
  std::mt19937_64 random(7);
  PointCloud cloud = RandomCloud(random, 5000, 2.0);
  const MlsMap map = Build(cloud);
  std::shuffle(cloud.points.begin(), cloud.points.end(), random);
  EXPECT_TRUE(Build(cloud) == map);
}

// Clouds that reach over several windows of 2¹⁶ cells, where keys of 32 bits do not suffice.
TEST(BuildMlsMapTest, EqualsTheReferenceFarFromTheSensor) {
  const MlsParameters parameters{.cell_size_m = 0.01};
  const SensorModel sensor{.max_range_m = 1e6};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    PointCloud cloud;
    for (int i = 0; i < 3000; ++i) {
      const double reach = std::pow(10.0, Uniform(random, 0, 3.5));
      cloud.points.emplace_back(static_cast<float>(std::floor(Uniform(random, -reach, reach))),
                                static_cast<float>(std::floor(Uniform(random, -reach, reach))),
                                static_cast<float>(Uniform(random, -3, 3)));
    }
    if (seed % 2 == 0) AddColumns(random, cloud);
    const Pose T_map_scan = MakePose(Eigen::Quaterniond::Identity(), {0.005, 0.005, 0});
    ASSERT_TRUE(Build(cloud, T_map_scan, sensor, parameters) ==
                ReferenceMap(cloud, T_map_scan, sensor, parameters));
  }
}

TEST(BuildMlsMapTest, UtmCoordinatesLoseNothing) {
  std::mt19937_64 random(11);
  PointCloud near = RandomCloud(random, 4000, 30);
  // The same cloud 409600 m east and 5324800 m north: a whole number of tiles of 25.6 m. Points
  // keep off the borders of cells, where the last bit of the far pose decides.
  for (Eigen::Vector3f& p : near.points) {
    p.x() = std::floor(p.x() * 10) / 10 + 0.05F;
    p.y() = std::floor(p.y() * 10) / 10 + 0.05F;
    p.z() = std::floor(p.z() * 4096) / 4096;
  }
  PointCloud far = near;
  far.origin = {409600.0, 5324800.0, 0.0};
  const MlsMap near_map = Build(near);
  MlsMap far_map = Build(far);
  for (MlsTile& tile : far_map.tiles) {
    tile.key.x -= 16000;
    tile.key.y -= 208000;
  }
  EXPECT_TRUE(far_map == near_map);
}

TEST(BuildMlsMapTest, CellsAreHalfOpenOnBothSidesOfZero) {
  PointCloud cloud;
  cloud.points = {{0.0F, 0.0F, 0.0F}, {-0.5F, 0.0F, 0.0F}, {0.5F, -0.25F, 0.0F}};
  cloud.sensor_origin = {0.0F, 0.0F, 1.0F};
  const MlsMap map = Build(cloud, Pose::Identity(), {}, {.cell_size_m = 0.5});
  EXPECT_EQ(map.Cell({0, 0}).size(), 1U);
  EXPECT_EQ(map.Cell({-1, 0}).size(), 1U);
  EXPECT_EQ(map.Cell({1, -1}).size(), 1U);
}

TEST(BuildMlsMapTest, CountsWhatItDrops) {
  PointCloud cloud;
  cloud.points = {{kNaN, kNaN, kNaN},
                  {kInfinity, 0, 0},
                  {0, 0, -kInfinity},
                  {0.1F, 0, 0},
                  {101, 0, 0},
                  {0, 0, 60},
                  {0, 0, -60},
                  {1, 2, 3}};
  const Pose T_map_scan = MakePose(Eigen::Quaterniond::Identity(), {0, 0, 2000});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const MlsBuildResult result,
      BuildMlsMap(cloud, T_map_scan, {.min_range_m = 0.5, .max_range_m = 100}, {}));
  EXPECT_EQ(result.dropped, (DroppedPoints{.not_finite = 3, .out_of_range = 2, .outside_map = 1}));
  EXPECT_EQ(result.map.patch_count(), 2U);
  EXPECT_EQ(BuildMlsMap({}, T_map_scan, {}, {})->map.tiles.size(), 0U);
}

// What sensors write where nothing came back: of no use however near the sensor may measure.
TEST(BuildMlsMapTest, ReturnsOfRangeZeroAreNoSurface) {
  PointCloud cloud;
  cloud.sensor_origin = {1, 2, 3};
  cloud.points = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3.01F}, {0, 0, 0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const MlsBuildResult result,
                              BuildMlsMap(cloud, Pose::Identity(), {}, {}));
  EXPECT_EQ(result.dropped, (DroppedPoints{.out_of_range = 2}));
  EXPECT_EQ(result.map.patch_count(), 2U);
}

TEST(BuildMlsMapTest, BeyondTheLastCellIsDropped) {
  PointCloud cloud;
  cloud.points = {{-0.5F, 0, 0}, {0.5F, 0, 0}};
  cloud.origin = {(1 << 30) * 0.01, 0, 0};
  STRATA_ASSERT_OK_AND_ASSIGN(const MlsBuildResult result,
                              BuildMlsMap(cloud, Pose::Identity(), {}, {.cell_size_m = 0.01}));
  EXPECT_EQ(result.dropped.outside_map, 1U);
  EXPECT_EQ(result.map.tiles.front().key.x, (1 << 22) - 1);
}

TEST(BuildMlsMapTest, RefusesWhatDoesNotValidate) {
  PointCloud cloud;
  cloud.points = {{1, 0, 0}};
  const auto build = [&](const PointCloud& c, const Pose& pose, SensorModel s, MlsParameters p) {
    return BuildMlsMap(c, pose, s, p).status();
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  const Pose identity = Pose::Identity();
  EXPECT_THAT(build(cloud, identity, {}, {.cell_size_m = 0}),
              StatusIs(kInvalid, HasSubstr("cell_size_m = 0")));
  EXPECT_THAT(build(cloud, identity, {.sigma_m = -1}, {}),
              StatusIs(kInvalid, HasSubstr("sigma_m = -1")));
  Pose sheared = identity;
  sheared.linear()(0, 1) = 1;
  EXPECT_THAT(build(cloud, sheared, {}, {}), StatusIs(kInvalid, HasSubstr("rotation")));
  PointCloud bad = cloud;
  bad.label = {1, 2};
  EXPECT_THAT(build(bad, identity, {}, {}),
              StatusIs(kInvalid, HasSubstr("label has 2 entries for 1 points")));
  bad = cloud;
  bad.sensor_origin.x() = kNaN;
  EXPECT_THAT(build(bad, identity, {}, {}), StatusIs(kInvalid, HasSubstr("sensor origin")));
}

TEST(BuildMlsMapTest, ManyMeasurementsFillAPatch) {
  // τ = 1 m bounds Σw at 2³⁸ − 1: 2²² measurements of weight 2¹⁶ reach it, and count saturates.
  PointCloud cloud;
  cloud.points.assign((1 << 22) + 5, {0.05F, 0.05F, 0.25F});
  cloud.points.front().z() = 0.0F;
  const MlsParameters parameters{.thickness_m = 1.0};
  const MlsMap map =
      Build(cloud, Pose::Identity(), {.sigma_m = 0.001, .sigma_per_metre = 0}, parameters);
  ASSERT_EQ(map.patch_count(), 1U);
  const Patch& patch = map.tiles[0].patches[0];
  EXPECT_EQ(patch.sum_w, (std::uint64_t{1} << 38) - 1);
  EXPECT_EQ(patch.sum_wz, 0U);
  EXPECT_EQ(patch.sum_wzz, 0U);
  EXPECT_EQ(patch.count, Patch::kMaxCount);
  EXPECT_NEAR(patch.mean_m(), 0.125, 1e-9);
}

TEST(RangeSigmaTableTest, AgreesWithTheSensorModelAtEveryStep) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const SensorModel model{
        .sigma_m = std::pow(10.0, Uniform(random, -3.3, 0)),
        .sigma_per_metre = seed == 1 ? 0 : std::pow(10.0, Uniform(random, -5, 0))};
    const RangeSigmaTable table(model);
    float r2 = 1e-12F;
    while (r2 <= 1e12F) {
      const double sigma_m = model.SigmaAt(std::sqrt(double{r2}));
      ASSERT_EQ(table.Code(std::bit_cast<std::uint32_t>(r2)), SigmaCode(sigma_m)) << r2;
      r2 *= static_cast<float>(Uniform(random, 1.0001, 1.01));
    }
  }
}

}  // namespace
}  // namespace strata
