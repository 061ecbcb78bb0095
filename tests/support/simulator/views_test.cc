#include "tests/support/simulator/views.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::testing {
namespace {

Eigen::AlignedBox3d BoxOf(const View& view) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : view.cloud.points) {
    if (p.allFinite()) box.extend(view.T_world_sensor * p.cast<double>());
  }
  return box;
}

TEST(ViewsTest, TheSmallHouseHasTheThesisSizeAndIsSeenInParts) {
  const std::vector<View> views = TakeViews(SmallHouse(), 4, {}, 1);
  ASSERT_EQ(views.size(), 4U);
  Eigen::AlignedBox3d all;
  for (const View& view : views) {
    EXPECT_GT(CountFinite(view.cloud), 3000U);
    EXPECT_TRUE(view.cloud.organised());
    all.extend(BoxOf(view));
  }
  EXPECT_TRUE(all.min().isApprox(Eigen::Vector3d(-1.5, -2.5, 0.0), 0.05)) << all.min().transpose();
  EXPECT_TRUE(all.max().isApprox(Eigen::Vector3d(1.5, 2.5, 3.0), 0.05)) << all.max().transpose();
}

TEST(ViewsTest, TheSensorLooksAtTheHouse) {
  for (const View& view : TakeViews(SmallHouse(), 3, {}, 2)) {
    const Eigen::Vector3d ahead = view.T_world_sensor.linear().col(0);
    EXPECT_LT(ahead.head<2>().dot(view.T_world_sensor.translation().head<2>()), -5.9);
  }
}

TEST(ViewsTest, TheLargeBuildingIsSeventyByTwentyByEleven) {
  Tour tour;
  tour.half_x_m = 55.0;
  tour.half_y_m = 35.0;
  tour.height_m = 1.8;
  tour.pixel_rad = 0.0175;
  Eigen::AlignedBox3d above_ground;
  for (const View& view : TakeViews(LargeBuilding(), 2, tour, 3)) {
    for (const Eigen::Vector3f& p : view.cloud.points) {
      const Eigen::Vector3d q = view.T_world_sensor * p.cast<double>();
      if (p.allFinite() && q.z() > 0.5) above_ground.extend(q);
    }
  }
  EXPECT_NEAR(above_ground.sizes().x(), 70.8, 0.5);
  EXPECT_NEAR(above_ground.sizes().y(), 20.8, 0.5);
  EXPECT_NEAR(above_ground.max().z(), 11.0, 0.5);
}

TEST(ViewsTest, ErrorsAreZeroAtTheTruthAndThoseOfTheNoiseAtTheStart) {
  const std::vector<View> views = TakeViews(SmallHouse(), 4, {}, 4);
  std::vector<Pose> truth;
  for (const View& view : views) truth.push_back(view.T_world_sensor);
  EXPECT_LT(ErrorsOf(views, truth).position_m, 1e-12);
  const Pose moved = Retract(Pose::Identity(), Vector6d::LinSpaced(-0.2, 0.3));
  for (Pose& T : truth) T = moved * T;
  EXPECT_LT(ErrorsOf(views, truth).position_m, 1e-9) << "the same world elsewhere";
  double angle = 0.0;
  double position = 0.0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const PoseErrors errors = ErrorsOf(views, NoisyStart(views, 0.01, 0.1, seed));
    angle += errors.angle_rad / 200;
    position += errors.position_m / 200;
  }
  const double mean_norm = 2 * std::sqrt(2 / M_PI);  // of three standard normal numbers
  EXPECT_NEAR(angle, 0.01 * mean_norm, 0.0006);
  EXPECT_NEAR(position, 0.1 * mean_norm, 0.006);
}

}  // namespace
}  // namespace strata::testing
