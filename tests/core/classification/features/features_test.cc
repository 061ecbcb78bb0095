#include "core/classification/features/features.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/features/columns.h"
#include "core/classification/features/ground_height.h"
#include "core/classification/features/local_shape.h"
#include "core/classification/features/voxels.h"
#include "tests/core/classification/amn/random_networks.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;

// The column of a feature.
Eigen::Index ColumnOf(const PointFeatureOptions& options, const std::string& name) {
  const std::vector<std::string> names = FeatureNames(options);
  const auto it = std::find(names.begin(), names.end(), name);
  EXPECT_NE(it, names.end()) << name;
  return it - names.begin();
}

// A level square of points 10 cm apart.
std::vector<Eigen::Vector3f> Floor(int across) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      points.emplace_back(0.1F * static_cast<float>(i), 0.1F * static_cast<float>(j), 0.0F);
    }
  }
  return points;
}

TEST(LocalShapeTest, KnowsAPlaneALineAndABall) {
  const std::vector<std::uint32_t> four = {0, 1, 2, 3};
  // Ends of a cross of arms 2 and 1 in the plane x + z = const, around the origin.
  const float r = std::numbers::sqrt2_v<float> / 2.0F;
  const std::vector<Eigen::Vector3f> plane = {
      {2 * r, 0, -2 * r}, {-2 * r, 0, 2 * r}, {0, 1, 0}, {0, -1, 0}};
  const LocalShape flat = DescribeShape(Eigen::Vector3f::Zero(), plane, four);
  EXPECT_NEAR(flat.values[0], 8.0F / 5.0F, 1e-5F);
  EXPECT_NEAR(flat.values[1], 2.0F / 5.0F, 1e-5F);
  EXPECT_NEAR(flat.linearity(), 0.75F, 1e-4F);
  EXPECT_NEAR(flat.planarity(), 0.25F, 1e-4F);
  EXPECT_NEAR(flat.scattering(), 0.0F, 1e-4F);
  EXPECT_NEAR(flat.verticality(), 1.0F - r, 1e-3F);
  EXPECT_NEAR(std::abs(flat.axis.dot(Eigen::Vector3f(r, 0, -r))), 1.0F, 1e-3F);
  const std::vector<Eigen::Vector3f> line = {{0, 0, 1}, {0, 0, 2}, {0, 0, -1}, {0, 0, -2}};
  const LocalShape pole = DescribeShape(Eigen::Vector3f::Zero(), line, four);
  EXPECT_NEAR(pole.linearity(), 1.0F, 1e-3F);
  EXPECT_NEAR(std::abs(pole.axis.z()), 1.0F, 1e-4F);
  const std::vector<Eigen::Vector3f> ball = {
      {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const std::vector<std::uint32_t> six = {0, 1, 2, 3, 4, 5};
  EXPECT_NEAR(DescribeShape(Eigen::Vector3f::Zero(), ball, six).scattering(), 1.0F, 1e-4F);
  const std::vector<Eigen::Vector3f> same = {{0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(DescribeShape(Eigen::Vector3f::Zero(), same, std::vector<std::uint32_t>{0, 1}).values,
            Eigen::Vector3f::Zero());
}

TEST(VoxelsTest, MeansOfHalfOpenCubes) {
  const std::vector<Eigen::Vector3f> points = {
      {0.1F, 0.1F, 0.1F}, {0.3F, 0.1F, 0.1F}, {0.5F, 0.1F, 0.1F}, {-0.1F, 0.1F, 0.1F}};
  const std::vector<Eigen::Vector3f> means = VoxelMeans(points, 0.5);
  ASSERT_EQ(means.size(), 3U);
  EXPECT_TRUE(means[0].isApprox(points[3]));
  EXPECT_TRUE(means[1].isApprox(Eigen::Vector3f(0.2F, 0.1F, 0.1F)));
  EXPECT_TRUE(means[2].isApprox(points[2]));
}

TEST(ColumnsTest, KnowWhatIsAboveBelowAndInBetween) {
  // A wire over a floor, and a wall; one column apart.
  const std::vector<Eigen::Vector3f> points = {{0.1F, 0.1F, 0.0F},
                                               {0.3F, 0.2F, 2.1F},
                                               {1.1F, 0.1F, 0.1F},
                                               {1.1F, 0.1F, 0.3F},
                                               {1.2F, 0.3F, 0.4F},
                                               {1.2F, 0.3F, 0.6F}};
  const std::vector<float> ground(points.size(), 0.0F);
  const std::vector<ColumnPlace> places = ColumnPlaces(points, ground, 0.5);
  EXPECT_NEAR(places[0].above_m, 2.1F, 1e-6F);
  EXPECT_EQ(places[0].below_m, 0.0F);
  EXPECT_EQ(places[0].filled, 1.0F);
  EXPECT_NEAR(places[1].below_m, 2.1F, 1e-6F);
  EXPECT_NEAR(places[1].filled, 2.0F / 9.0F, 1e-6F) << "two of the nine levels up to 2.25 m";
  EXPECT_NEAR(places[3].above_m, 0.3F, 1e-6F);
  EXPECT_NEAR(places[3].below_m, 0.2F, 1e-6F);
  EXPECT_EQ(places[5].filled, 1.0F);
  // In wider columns all stand together.
  EXPECT_NEAR(ColumnPlaces(points, ground, 2.0)[5].above_m, 1.5F, 1e-6F);
}

TEST(GroundHeightTest, IsAboveTheLowestAroundNotAboveStrayReturns) {
  std::vector<Eigen::Vector3f> points = Floor(60);  // 6 m × 6 m
  const std::size_t floor = points.size();
  points.emplace_back(3.0F, 3.0F, 2.5F);
  points.emplace_back(1.0F, 1.0F, -4.0F);  // one return from below
  points.emplace_back(40.0F, 0.0F, 3.0F);  // alone
  points.emplace_back(8.0F, 3.0F, 1.0F);   // 2 m beside the floor
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<float> heights, HeightsAboveLowest(points));
  for (std::size_t i = 0; i < floor; ++i) ASSERT_NEAR(heights[i], 0.0F, 1e-3F);
  EXPECT_NEAR(heights[floor], 2.5F, 1e-3F);
  EXPECT_EQ(heights[floor + 1], 0.0F);
  EXPECT_EQ(heights[floor + 2], 0.0F);
  EXPECT_NEAR(heights[floor + 3], 1.0F, 1e-3F);
}

TEST(FeaturesTest, ShapesOfAFloorAndAPole) {
  PointCloud cloud;
  cloud.points = Floor(50);
  const auto pole = static_cast<Eigen::Index>(cloud.size() + 50);
  for (int k = 0; k < 100; ++k)
    cloud.points.emplace_back(2.5F, 2.5F, 0.03F * static_cast<float>(k));
  const PointFeatureOptions options;
  STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix features,
                              ComputeFeatures(cloud, options, Stop()));
  const auto at = [&](Eigen::Index row, const std::string& name) {
    return features(row, ColumnOf(options, name));
  };
  constexpr Eigen::Index kFloor = 20 * 50 + 10;
  for (const char* scale : {".0", ".1", ".2"}) {
    EXPECT_LT(at(kFloor, std::string("verticality") + scale), 0.05F);
    EXPECT_GT(at(pole, std::string("linearity") + scale), 0.9F) << scale;
    EXPECT_GT(at(pole, std::string("axis_verticality") + scale), 0.9F);
  }
  EXPECT_GT(at(kFloor, "planarity.0"), 0.5F);
  EXPECT_EQ(at(kFloor, "height.0.5"), 0.0F);
  EXPECT_EQ(at(pole, "height.0.5"), 1.0F);
  EXPECT_NEAR(at(pole, "height.3"), 0.5F, 0.01F);
  EXPECT_NEAR(at(pole, "height.15"), 0.1F, 0.01F);
  EXPECT_NEAR(at(pole, "below.0.5"), 0.5F, 0.01F);
  EXPECT_NEAR(at(pole, "above.0.5"), 0.49F, 0.01F);
  EXPECT_EQ(at(pole, "filled.2"), 1.0F);
  // The 16 nearest on a grid of 10 cm reach to its third ring, or 3 cm times 8 along the pole.
  EXPECT_NEAR(at(kFloor, "reach.0"), 0.2F * std::sqrt(1.25F) / 1.2F, 1e-3F);
  EXPECT_NEAR(at(pole, "reach.0"), 0.24F / 1.2F, 1e-3F);
  EXPECT_EQ(at(pole, "constant"), 1.0F);
}

TEST(FeaturesTest, AWindowLiesBehindItsWall) {
  // A wall across y with a recess of 10 cm; the sensor stands at the origin.
  PointCloud cloud;
  const auto recess = [](float x, float z) { return x > 0.5F && x < 2.0F && z > 1.0F && z < 2.5F; };
  for (float x = -4.0F; x <= 4.0F; x += 0.05F) {
    for (float z = 0.0F; z <= 5.0F; z += 0.05F) {
      cloud.points.emplace_back(x, recess(x, z) ? 6.1F : 6.0F, z);
    }
  }
  PointFeatureOptions options;
  options.set = FeatureSet::kWall;
  STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix features,
                              ComputeFeatures(cloud, options, Stop()));
  const Eigen::Index front = ColumnOf(options, "side.front");
  const Eigen::Index in = ColumnOf(options, "side.in");
  const Eigen::Index behind = ColumnOf(options, "side.behind");
  const Eigen::Index parallel = ColumnOf(options, "angle.7");
  int borders = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(features.row(row).head(8).sum(), 1.0F, 1e-4F);
    EXPECT_NEAR(features(row, front) + features(row, in) + features(row, behind), 1.0F, 1e-4F);
    const Eigen::Vector3f& p = cloud.points[i];
    if (p.x() < -0.5F && p.x() > -3.5F && p.z() > 0.5F && p.z() < 4.5F) {
      EXPECT_EQ(features(row, in), 1.0F) << p.transpose();
      EXPECT_EQ(features(row, parallel), 1.0F) << p.transpose();
    }
    // At the border of the recess the wall is in front, on the side of the sensor.
    if (p.y() > 6.05F) {
      EXPECT_EQ(features(row, behind), 0.0F);
    }
    borders += p.y() > 6.05F && features(row, front) > 0.0F ? 1 : 0;
  }
  EXPECT_GT(borders, 20);
}

TEST(FeaturesTest, SpinImagesDoNotDependOnWhereAndHowAThingStands) {
  SplitMix64 random(6);
  PointCloud cloud;
  for (int k = 0; k < 1500; ++k) {
    // A bowl that opens towards the sensor far below it.
    const double x = testing::RandomIn(-0.5, 0.5, random);
    const double y = testing::RandomIn(-0.5, 0.5, random);
    cloud.points.emplace_back(
        static_cast<float>(x), static_cast<float>(y), static_cast<float>(0.5 * (x * x + y * y)));
  }
  cloud.sensor_origin = {0.0F, 0.0F, 20.0F};
  PointFeatureOptions options;
  options.set = FeatureSet::kSpin;
  options.spin_radius_m = 0.3;
  STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix here, ComputeFeatures(cloud, options, Stop()));
  ASSERT_EQ(here.cols(), 51);
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(0.7F, Eigen::Vector3f(1.0F, 2.0F, -0.5F).normalized()).toRotationMatrix();
  for (Eigen::Vector3f& p : cloud.points) p = turn * p + Eigen::Vector3f(1.0F, -2.0F, 3.0F);
  cloud.sensor_origin = turn * cloud.sensor_origin + Eigen::Vector3f(1.0F, -2.0F, 3.0F);
  STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix there, ComputeFeatures(cloud, options, Stop()));
  // A point at the edge of the ball may come or go by rounding.
  EXPECT_LT((here - there).cwiseAbs().mean(), 2e-4F);
  for (Eigen::Index i = 0; i < here.rows(); ++i)
    EXPECT_NEAR(here.row(i).head(50).squaredNorm(), 1.0F, 1e-4F);
}

TEST(FeaturesTest, SpinImagesShareAPointAmongFourBins) {
  // A flat grid seen from above, far smaller than a bin, and one point above its middle.
  PointCloud cloud;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) cloud.points.emplace_back(0.001F * i, 0.001F * j, 0.0F);
  }
  cloud.points.emplace_back(0.0F, 0.3F, 0.15F);
  cloud.sensor_origin = {0.0F, 0.0F, 20.0F};
  PointFeatureOptions options;
  options.set = FeatureSet::kSpin;
  options.spin_radius_m = 1.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix f, ComputeFeatures(cloud, options, Stop()));
  // Across 0.3 m of bins of 0.2 m: between the centres 0.1 and 0.3, at the second. Along 0.15 m
  // of bins of 0.2 m from −1 m: between the centres 0.1 (bin 5) and 0.3 (bin 6), a quarter above.
  const Eigen::Index middle = 24;
  const auto share = [&](int across, int along) {
    return 50.0F * std::pow(f(middle, across * 10 + along), 2.0F);
  };
  EXPECT_NEAR(share(1, 5), 0.75F, 0.01F);
  EXPECT_NEAR(share(1, 6), 0.25F, 0.01F);
  EXPECT_NEAR(share(0, 4) + share(0, 5), 49.0F, 0.01F) << "the grid, in the middle of two";
  EXPECT_NEAR(share(0, 4), 24.5F, 0.5F);
}

TEST(FeaturesTest, PointsThatAreNoneHaveNoFeatures) {
  for (const FeatureSet set : {FeatureSet::kShape, FeatureSet::kWall, FeatureSet::kSpin}) {
    PointFeatureOptions options;
    options.set = set;
    SCOPED_TRACE(std::string(ToString(set)));
    STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix none,
                                ComputeFeatures(PointCloud(), options, Stop()));
    EXPECT_EQ(none.rows(), 0);
    PointCloud cloud;
    cloud.points = Floor(12);
    STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix all, ComputeFeatures(cloud, options, Stop()));
    ASSERT_EQ(all.cols(), static_cast<Eigen::Index>(FeatureNames(options).size()));
    cloud.points.insert(cloud.points.begin() + 5, Eigen::Vector3f::Constant(NAN));
    STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix with, ComputeFeatures(cloud, options, Stop()));
    ASSERT_TRUE(with.allFinite());
    EXPECT_EQ(with.row(5).sum(), 1.0F) << "the constant";
    EXPECT_EQ(with.row(4), all.row(4));
    EXPECT_EQ(with.row(6), all.row(5));
    cloud.points = {{1, 2, 3}};
    STRATA_ASSERT_OK_AND_ASSIGN(const FeatureMatrix one, ComputeFeatures(cloud, options, Stop()));
    EXPECT_TRUE(one.allFinite());
    STRATA_ASSERT_OK_AND_ASSIGN(const FeatureSet named, FeatureSetFromName(ToString(set)));
    EXPECT_EQ(named, set);
  }
  EXPECT_THAT(
      FeatureSetFromName("colour"),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("shape, wall, spin")));
  PointFeatureOptions options;
  options.neighbours = 1;
  EXPECT_THAT(ComputeFeatures(PointCloud(), options, Stop()),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("neighbours")));
}

}  // namespace
}  // namespace strata
