// Upright features lie on the faces that their points show, not in the middles of cells.
#include "core/registration/upright_offsets.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/random.h"
#include "core/mls/build.h"
#include "core/registration/scan_features.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kSeed = 20261128;
constexpr double kCellM = 0.1;

MlsMap MapOf(const PointCloud& cloud) {
  MlsParameters parameters;
  parameters.cell_size_m = kCellM;
  return BuildMlsMap(cloud, Pose::Identity(), SensorModel(), parameters)->map;
}

// Points all over a wall of 4 m by 2 m through (x, 2, 0) along y, or in a box around it.
PointCloud WallAt(double x, double half_width_m, int points) {
  SplitMix64 random(kSeed);
  const auto between = [&random](double low, double high) {
    return static_cast<float>(low + (high - low) * random.Uniform());
  };
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud.points.emplace_back(
        between(x - half_width_m, x + half_width_m), between(0.0, 4.0), between(-1.0, 1.0));
  }
  return cloud;
}

std::vector<Eigen::Vector3f> UprightOf(const PointCloud& cloud) {
  const MlsMap map = MapOf(cloud);
  const ScanFeatureOptions options;
  UprightOffsets offsets(map, options.samples_per_metre);
  const std::span<const Eigen::Vector3f> points = cloud.points;  // pieces of any size add up
  offsets.Add(points.first(points.size() / 3));
  offsets.Add(points.subspan(points.size() / 3));
  return ScanFeatures::FromMap(map, options, &offsets).points(FeatureClass::kVertical);
}

double MeanX(const std::vector<Eigen::Vector3f>& points) {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : points) sum += p.x();
  return sum / static_cast<double>(points.size());
}

TEST(UprightOffsetsTest, AWallAlongTheCellsIsWhereItIsInThem) {
  for (const double x : {3.02, 3.05, 3.08, -2.97}) {
    const PointCloud wall = WallAt(x, 0.01, 40000);
    const std::vector<Eigen::Vector3f> features = UprightOf(wall);
    ASSERT_GE(features.size(), 40U);
    EXPECT_NEAR(MeanX(features), x, 0.001) << x;
    for (const Eigen::Vector3f& p : features) EXPECT_NEAR(p.x(), x, 0.006);
    const double middle = (std::floor(x / kCellM) + 0.5) * kCellM;
    const auto without = ScanFeatures::FromMap(MapOf(wall)).points(FeatureClass::kVertical);
    EXPECT_NEAR(MeanX(without), middle, 1e-5) << x;
    EXPECT_EQ(features.size(), without.size());
  }
}

// Few of its points are beyond the border, and none of those lies on it.
TEST(UprightOffsetsTest, AWallAtTheBorderOfCellsIsOneFace) {
  for (const double x : {3.017, 2.983, 3.0}) {
    const std::vector<Eigen::Vector3f> features = UprightOf(WallAt(x, 0.02, 12000));
    ASSERT_GE(features.size(), 60U);
    EXPECT_NEAR(MeanX(features), x, 0.002) << x;
    for (const Eigen::Vector3f& p : features) EXPECT_NEAR(p.x(), x, 0.012) << x;
  }
}

// The same whichever way it runs through the cells.
TEST(UprightOffsetsTest, AWallAcrossTheCellsIsOneFace) {
  constexpr double kTurnRad = 0.4;
  PointCloud wall = WallAt(3.0, 0.01, 20000);
  const Eigen::Rotation2Df turn(static_cast<float>(kTurnRad));
  for (Eigen::Vector3f& p : wall.points) p.head<2>() = turn * Eigen::Vector2f(p.head<2>());
  double squares = 0.0;
  const std::vector<Eigen::Vector3f> features = UprightOf(wall);
  ASSERT_GE(features.size(), 100U);
  for (const Eigen::Vector3f& p : features) {
    const double off = (turn.inverse() * Eigen::Vector2f(p.head<2>())).x() - 3.0;
    squares += off * off;
  }
  EXPECT_LE(std::sqrt(squares / static_cast<double>(features.size())), 0.003);
}

TEST(UprightOffsetsTest, HedgesAndSparseCellsStayInTheMiddle) {
  // The hedge fills its cells, of which half a one would pass for a face.
  for (const PointCloud& cloud : {WallAt(3.0, 0.3, 200000), WallAt(3.02, 0.01, 40)}) {
    const std::vector<Eigen::Vector3f> features = UprightOf(cloud);
    ASSERT_GE(features.size(), 15U);
    int moved = 0;
    for (const Eigen::Vector3f& p : features) {
      const double cells = p.x() / kCellM;
      moved += std::abs(cells - std::floor(cells) - 0.5) > 1e-3 ? 1 : 0;
    }
    EXPECT_LE(moved, 1 + static_cast<int>(features.size()) / 20);
  }
}

// Whatever else there is, of any size, finite or not, moves nothing and reads nothing beyond.
TEST(UprightOffsetsTest, PointsThatAreInNoPatchAreLeftOut) {
  const PointCloud wall = WallAt(3.02, 0.01, 40000);
  const MlsMap map = MapOf(wall);
  const ScanFeatureOptions options;
  UprightOffsets offsets(map, options.samples_per_metre);
  offsets.Add(wall.points);
  constexpr float kHuge = std::numeric_limits<float>::max();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> strange = {{kNan, 1.0F, 0.0F},
                                                {3.09F, kNan, 0.0F},
                                                {3.09F, 1.0F, kNan},
                                                {kHuge, -kHuge, 0.0F},
                                                {3.09F, 1.0F, kHuge},
                                                {3.09F, 1.0F, -5.0F},
                                                {1.5e8F, 1.0F, 0.0F}};
  for (int i = 0; i < 1000; ++i) offsets.Add(strange);
  const ScanFeatures features = ScanFeatures::FromMap(map, options, &offsets);
  EXPECT_NEAR(MeanX(features.points(FeatureClass::kVertical)), 3.02, 0.001);
}

}  // namespace
}  // namespace strata::testing
