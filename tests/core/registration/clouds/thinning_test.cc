#include "core/registration/clouds/thinning.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using Cube = std::array<int, 3>;

Cube CubeOf(const Eigen::Vector3f& p, float edge) {
  return {static_cast<int>(std::floor(p.x() / edge)),
          static_cast<int>(std::floor(p.y() / edge)),
          static_cast<int>(std::floor(p.z() / edge))};
}

TEST(ThinCloudTest, EachCubeHasTheCentreOfItsPoints) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> u(-3.0F, 3.0F);
  PointCloud cloud;
  cloud.origin = {100.0, 200.0, 300.0};
  cloud.sensor_origin = {1.0F, 2.0F, 3.0F};
  for (int i = 0; i < 5'000; ++i) cloud.points.emplace_back(u(random), u(random), u(random));
  std::map<Cube, std::pair<Eigen::Vector3d, int>> sums;
  for (const Eigen::Vector3f& p : cloud.points) {
    auto& [sum, count] =
        sums.try_emplace(CubeOf(p, 0.5F), Eigen::Vector3d::Zero(), 0).first->second;
    sum += p.cast<double>();
    ++count;
  }
  cloud.points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  const PointCloud thinned = ThinCloud(cloud, 0.5);
  EXPECT_EQ(thinned.origin, cloud.origin);
  EXPECT_EQ(thinned.sensor_origin, cloud.sensor_origin);
  ASSERT_EQ(thinned.size(), sums.size());
  for (const Eigen::Vector3f& p : thinned.points) {
    const auto found = sums.find(CubeOf(p, 0.5F));
    ASSERT_NE(found, sums.end());
    const auto& [sum, count] = found->second;
    EXPECT_LT((p.cast<double>() - sum / count).norm(), 1e-5);
  }
}

TEST(ThinCloudTest, FarPointsMakeCubesLargerInsteadOfKeepingAll) {
  PointCloud cloud;
  for (int i = 0; i < 1'000; ++i)
    cloud.points.emplace_back(0.001F * static_cast<float>(i), 0.0F, 0.0F);
  cloud.points.emplace_back(5e4F, -5e4F, 5e4F);
  const PointCloud thinned = ThinCloud(cloud, 0.1);
  EXPECT_LT(thinned.size(), 10U);
  EXPECT_GE(thinned.size(), 2U);
}

TEST(ThinCloudTest, NothingIsNothing) { EXPECT_EQ(ThinCloud(PointCloud(), 0.1).size(), 0U); }

}  // namespace
}  // namespace strata
