#include "core/egomotion/trajectory.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/screw_motion.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TrajectoryPose At(double time_s, double x, double yaw_rad, double variance) {
  TrajectoryPose pose;
  pose.time_s = time_s;
  pose.T_map_body = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), {x, 0.0, 0.0});
  pose.covariance = variance * Matrix6d::Identity();
  return pose;
}

TEST(TrajectoryTest, IsBetweenItsPoses) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Trajectory trajectory,
      Trajectory::Make({At(10, 0, 0, 1), At(11, 2, 1, 3), At(20, 4, 1, 1)}));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryPose pose, trajectory.At(10.25));
  const auto& poses = trajectory.poses();
  EXPECT_TRUE(
      pose.T_map_body.isApprox(Interpolate(poses[0].T_map_body, poses[1].T_map_body, 0.25), 1e-12));
  EXPECT_DOUBLE_EQ(pose.time_s, 10.25);
  EXPECT_NEAR(pose.covariance(3, 3), 1.5, 1e-12);
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryPose last, trajectory.At(20.0));
  EXPECT_TRUE(last.T_map_body.isApprox(poses[2].T_map_body));
}

TEST(TrajectoryTest, SaysNothingOutsideAndInGaps) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Trajectory trajectory,
      Trajectory::Make({At(10, 0, 0, 1), At(11, 2, 1, 3), At(20, 4, 1, 1)}));
  constexpr auto kOut = absl::StatusCode::kOutOfRange;
  EXPECT_THAT(trajectory.At(9.9), StatusIs(kOut, HasSubstr("outside the trajectory, 10.0")));
  EXPECT_THAT(trajectory.At(20.1), StatusIs(kOut, HasSubstr("20.000000")));
  EXPECT_THAT(trajectory.At(15.0), StatusIs(kOut, HasSubstr("a gap of the trajectory of 9.000 s")));
  STRATA_EXPECT_OK(trajectory.At(15.0, 10.0).status());
  STRATA_ASSERT_OK_AND_ASSIGN(const Trajectory empty, Trajectory::Make({}));
  EXPECT_THAT(empty.At(1.0), StatusIs(kOut, HasSubstr("no poses")));
}

TEST(TrajectoryTest, RefusesWhatIsNone) {
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  EXPECT_THAT(Trajectory::Make({At(10, 0, 0, 1), At(10, 1, 0, 1)}),
              StatusIs(kInvalid, HasSubstr("pose 1: times must ascend")));
  EXPECT_THAT(Trajectory::Make({At(10, 0, 0, -1)}),
              StatusIs(kInvalid, HasSubstr("pose 0: covariance: a variance is negative")));
  TrajectoryPose skewed = At(10, 0, 0, 1);
  skewed.covariance(0, 1) = 0.5;
  EXPECT_THAT(Trajectory::Make({skewed}), StatusIs(kInvalid, HasSubstr("not symmetric")));
  TrajectoryPose scaled = At(10, 0, 0, 1);
  scaled.T_map_body.linear() *= 2.0;
  EXPECT_THAT(Trajectory::Make({scaled}), StatusIs(kInvalid, HasSubstr("no rotation")));
}

}  // namespace
}  // namespace strata
