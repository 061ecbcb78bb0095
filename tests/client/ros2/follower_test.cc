#include "client/ros2/follower.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::ros2 {
namespace {

Pose Moved(double metres, double radians) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitZ())),
                  {metres, 0.0, 0.0});
}

TEST(FollowerTest, AStepIsDueAfterTheWayAndTheTurnAndNeverMoreThanTenTimesASecond) {
  const absl::Duration tenth = absl::Milliseconds(100);
  EXPECT_TRUE(IsStepDue(Moved(0.1, 0.0), tenth, false));
  EXPECT_TRUE(IsStepDue(Moved(0.0, 0.06), tenth, false));
  EXPECT_FALSE(IsStepDue(Moved(0.09, 0.04), tenth, false));
  EXPECT_FALSE(IsStepDue(Moved(5.0, 1.0), tenth - absl::Milliseconds(1), false));
}

TEST(FollowerTest, ARobotThatStandsOrIsLostIsAskedAboutOnceASecond) {
  EXPECT_TRUE(IsStepDue(Moved(0.0, 0.0), absl::Seconds(1), false));
  EXPECT_FALSE(IsStepDue(Moved(0.0, 0.0), absl::Milliseconds(999), false));
  EXPECT_FALSE(IsStepDue(Moved(5.0, 1.0), absl::Milliseconds(999), true));
  EXPECT_TRUE(IsStepDue(Moved(5.0, 1.0), absl::Seconds(1), true));
}

TEST(FollowerTest, ALargeCloudGoesThinnedOutEvenly) {
  constexpr std::size_t kPoints = 100'000;
  PointCloud cloud;
  cloud.sensor_origin = {1, 2, 3};
  cloud.rows = 4;
  cloud.columns = kPoints / 4;
  for (std::size_t i = 0; i < kPoints; ++i) cloud.points.emplace_back(i, 0.0F, 0.0F);
  const PointCloud step = CloudForStep(cloud);
  ASSERT_EQ(step.size(), 40'000U);
  EXPECT_EQ(step.sensor_origin, cloud.sensor_origin);
  EXPECT_EQ(step.rows, 0U);  // it is no grid any more
  EXPECT_EQ(step.points.back().x(), kPoints - 1);
  for (std::size_t i = 1; i < step.size(); ++i) {
    const float apart = step.points[i].x() - step.points[i - 1].x();
    EXPECT_TRUE(apart == 2.0F || apart == 3.0F) << i;
  }
}

TEST(FollowerTest, ASmallCloudGoesAsItIsButForWhatCameBackFromNowhere) {
  PointCloud cloud;
  const float nowhere = std::numeric_limits<float>::quiet_NaN();
  cloud.points = {{1, 0, 0}, {nowhere, nowhere, nowhere}, {2, 0, 0}};
  cloud.rows = 1;
  cloud.columns = 3;
  EXPECT_THAT(CloudForStep(cloud).points,
              ::testing::ElementsAre(Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(2, 0, 0)));
  EXPECT_EQ(CloudForStep(PointCloud()).size(), 0U);
}

}  // namespace
}  // namespace strata::ros2
