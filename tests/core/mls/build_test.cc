#include "core/mls/build.h"

#include <algorithm>
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
using ::strata::testing::Uniform;

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

}  // namespace
}  // namespace strata
