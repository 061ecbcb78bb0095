#include "core/mls/join.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::RandomPose;
using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;
using ::strata::testing::Uniform;

// A few cells on both sides of a tile corner, so dense that intervals bridge each other; heights
// from a coarse raster (ties with different σ) or fine, colours and labels in some.
std::vector<ReferenceMeasurement> RandomMeasurements(std::mt19937_64& random, bool annotated) {
  std::vector<ReferenceMeasurement> result(random() % 400);
  const int step = 1 << (random() % 9);
  const int span = 1 + static_cast<int>(random() % 20000);
  const int cells = 1 + static_cast<int>(random() % 5);
  for (ReferenceMeasurement& m : result) {
    m.cell = {static_cast<std::int32_t>(random() % (2 * cells)) - cells,
              static_cast<std::int32_t>(random() % (2 * cells)) - cells};
    m.z = static_cast<std::int64_t>(random() % span) / step * step - span / 2;
    m.sigma_code = static_cast<std::uint8_t>(random() % 256);
    if (!annotated) continue;
    m.colour = {static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()), 7};
    m.label = static_cast<std::uint16_t>(random() % 4);
  }
  return result;
}

MlsParameters RandomParameters(std::mt19937_64& random) {
  return {.cell_size_m = 0.1,
          .gap_size_m = Uniform(random, 0.01, 1.5),
          .thickness_m = Uniform(random, 0.001, 1.0)};
}

TEST(JoinTest, JoinOfMapsIsMapOfUnionInAnyOrderAndAssociation) {
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const bool annotated = seed % 3 == 0;
    const MlsParameters parameters = RandomParameters(random);
    std::vector<ReferenceMeasurement> all;
    std::vector<MlsMap> maps;
    for (int part = 0; part < 4; ++part) {
      const auto measurements = RandomMeasurements(random, annotated);
      all.insert(all.end(), measurements.begin(), measurements.end());
      maps.push_back(ReferenceMap(measurements, parameters, annotated));
    }
    const MlsMap expected = ReferenceMap(all, parameters, annotated);
    std::shuffle(maps.begin(), maps.end(), random);
    const MlsMap left = JoinMaps(JoinMaps(JoinMaps(maps[0], maps[1]), maps[2]), maps[3]);
    const MlsMap right = JoinMaps(maps[3], JoinMaps(JoinMaps(maps[2], maps[1]), maps[0]));
    ASSERT_TRUE(left == expected);
    ASSERT_TRUE(right == expected);
    ASSERT_TRUE(JoinAll(maps, parameters) == expected);
    MlsMap accumulated{.parameters = parameters, .tiles = {}};
    for (const MlsMap& map : maps) JoinInto(accumulated, map);
    ASSERT_TRUE(accumulated == expected);
  }
}

TEST(JoinTest, ColourOfOneSideOnlyStays) {
  const MlsParameters parameters;
  const std::vector<ReferenceMeasurement> measurements = {
      {.cell = {0, 0}, .z = 5, .sigma_code = 9, .colour = {1, 2, 3}, .label = 4}};
  const MlsMap with = ReferenceMap(measurements, parameters, true);
  const MlsMap without = ReferenceMap(measurements, parameters, false);
  const MlsMap joined = JoinMaps(without, with);
  ASSERT_EQ(joined.tiles[0].colour.size(), 1U);
  EXPECT_EQ(joined.tiles[0].colour[0], (ColourSum{.r = 1, .g = 2, .b = 3, .count = 1}));
  EXPECT_EQ(joined.tiles[0].votes[0], (ClassVotes{.patch = 0, .class_id = 4, .count = 2}));
  EXPECT_TRUE(JoinMaps(with, without) == joined);
}

TEST(JoinTest, VotesSaturate) {
  MlsMap map = ReferenceMap({{.cell = {0, 0}, .label = 1}}, MlsParameters{});
  map.tiles[0].votes[0].count = 0xFFFFFFF0U;
  EXPECT_EQ(JoinMaps(map, map).tiles[0].votes[0].count, 0xFFFFFFFFU);
}

// The definition in join.h, patch by patch, then the reference's join of measurements.
TEST(TransformContributionTest, WholeCellsAndTicksAreExact) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const bool annotated = seed % 2 == 0;
    const MlsParameters parameters = RandomParameters(random);
    auto measurements = RandomMeasurements(random, annotated);
    const MlsMap local = ReferenceMap(measurements, parameters, annotated);
    const std::int32_t dx = static_cast<std::int32_t>(random() % 2000) - 1000;
    const std::int32_t dy = static_cast<std::int32_t>(random() % 2000) - 1000;
    const std::int32_t dz = static_cast<std::int32_t>(random() % 2000) - 1000;
    for (ReferenceMeasurement& m : measurements) {  // a quarter turn about z, then a shift
      m.cell = {-m.cell.y - 1 + dx, m.cell.x + dy};
      m.z += dz;
    }
    const Pose T =
        MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())),
                 {0.1 * dx, 0.1 * dy, dz / 4096.0});
    ASSERT_TRUE(TransformContribution(local, T) ==
                ReferenceMap(measurements, parameters, annotated));
  }
}

TEST(TransformContributionTest, KeepsEveryMeasurementAndStaysClose) {
  std::mt19937_64 random(4);
  std::vector<ReferenceMeasurement> measurements(3000);
  for (ReferenceMeasurement& m : measurements) {
    m.cell = {static_cast<std::int32_t>(random() % 60) - 30,
              static_cast<std::int32_t>(random() % 60) - 30};
    m.z = static_cast<std::int64_t>(random() % 200);
    m.sigma_code = 80;
  }
  const MlsMap local = ReferenceMap(measurements, MlsParameters{});
  const Pose T = RandomPose(random, 50);
  const MlsMap moved = TransformContribution(local, T);
  std::uint64_t count = 0;
  for (const MlsTile& tile : moved.tiles) {
    for (const Patch& patch : tile.patches) count += patch.count;
    for (const Patch& patch : tile.patches) {
      const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
      const Eigen::Vector3d back =
          T.inverse() * Eigen::Vector3d(0.1 * (cell.x + 0.5), 0.1 * (cell.y + 0.5), patch.mean_m());
      EXPECT_LT(std::abs(back.x()), 3.2);  // still in the square it came from
      EXPECT_LT(std::abs(back.y()), 3.2);
    }
  }
  EXPECT_EQ(count, 3000U);
}

TEST(TransformContributionTest, LeavingTheMapDropsThePatch) {
  const MlsMap local = ReferenceMap({{.cell = {0, 0}, .z = 100}}, MlsParameters{});
  const Pose T = MakePose(Eigen::Quaterniond::Identity(), {0, 0, 2048});
  EXPECT_TRUE(TransformContribution(local, T).tiles.empty());
  const Pose far = MakePose(Eigen::Quaterniond::Identity(), {1.1e8, 0, 0});
  EXPECT_TRUE(TransformContribution(local, far).tiles.empty());
}

}  // namespace
}  // namespace strata
