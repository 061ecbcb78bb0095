#include "core/mesh/point_thinner.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::StatusIs;

TEST(PointThinnerTest, KeepsTheMeanOfEachCube) {
  testing::Random random(3);
  PointThinner thinner({.edge_m = 0.25});
  std::map<std::array<int, 3>, std::pair<Vector3d, int>> expected;
  for (int scan = 0; scan < 3; ++scan) {
    PointCloud cloud;
    for (int i = 0; i < 500; ++i) {
      cloud.points.emplace_back(static_cast<float>(random.Uniform(-2, 2)),
                                static_cast<float>(random.Uniform(-2, 2)),
                                static_cast<float>(random.Uniform(0.1, 2)));
      const Vector3d p = cloud.points.back().cast<double>() + Vector3d(scan, 0, 0);
      auto& [sum, count] = expected[{static_cast<int>(std::floor(p.x() / 0.25)),
                                     static_cast<int>(std::floor(p.y() / 0.25)),
                                     static_cast<int>(std::floor(p.z() / 0.25))}];
      if (count == 0) sum.setZero();
      sum += p;
      ++count;
    }
    STRATA_ASSERT_OK(thinner.Add(cloud, testing::At({double(scan), 0, 0}), SensorModel(), Stop()));
  }
  EXPECT_EQ(thinner.size(), expected.size());
  const std::vector<Vector3d> points = thinner.Points().points;
  ASSERT_EQ(points.size(), expected.size());
  for (const Vector3d& p : points) {
    const auto& [sum, count] = expected.at({static_cast<int>(std::floor(p.x() / 0.25)),
                                            static_cast<int>(std::floor(p.y() / 0.25)),
                                            static_cast<int>(std::floor(p.z() / 0.25))});
    EXPECT_NEAR((p - sum / count).norm(), 0.0, 1e-5);
  }
}

TEST(PointThinnerTest, KnowsWherePointsWereSeenFrom) {
  PointCloud cloud;
  cloud.points = {{0.0F, 0.0F, 2.1F}};
  cloud.sensor_origin = {0.0F, 0.0F, 1.0F};
  Pose T = testing::At({5, 5, 5});
  T.rotate(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()));
  PointThinner thinner({.edge_m = 0.25});
  STRATA_ASSERT_OK(thinner.Add(cloud, T, SensorModel(), Stop()));
  // Down in the scan is along y in the map.
  ASSERT_EQ(thinner.Points().towards.size(), 1);
  EXPECT_LT((thinner.Points().towards[0] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6F);
}

TEST(PointThinnerTest, SaysWhatDoesNotFit) {
  PointCloud cloud;
  for (int i = 0; i < 100; ++i) cloud.points.emplace_back(static_cast<float>(i), 1.0F, 1.0F);
  PointThinner thinner({.edge_m = 0.5, .max_points = 50});
  EXPECT_THAT(thinner.Add(cloud, Pose::Identity(), SensorModel(), Stop()),
              StatusIs(absl::StatusCode::kResourceExhausted, ::testing::HasSubstr("50 points")));
  PointThinner far({.edge_m = 0.001});
  STRATA_EXPECT_OK(far.Add(cloud, Pose::Identity(), SensorModel(), Stop()));
  EXPECT_THAT(far.Add(cloud, testing::At({2e6, 0, 0}), SensorModel(), Stop()),
              StatusIs(absl::StatusCode::kOutOfRange, ::testing::_));
}

}  // namespace
}  // namespace strata
