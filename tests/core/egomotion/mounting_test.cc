#include "core/egomotion/mounting.h"

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TEST(MountingTest, IsFoundFromTheMotion) {
  testing::Random random(61);
  for (int i = 0; i < 5; ++i) {
    testing::DriveOptions options;
    options.yaw_mount_rad = 0.0;
    options.rig.R_body_imu = Eigen::Quaterniond(So3Exp(testing::DrawVector(random, 1.7)));
    options.rig.imu_body_m = {0.3, 0.0, 0.6};
    const MotionLog log = testing::SimulateDrive(options, 61 + i);
    STRATA_ASSERT_OK_AND_ASSIGN(const Eigen::Quaterniond found, FindMounting(log, Rig()));
    EXPECT_LT(found.angularDistance(*options.rig.R_body_imu), 0.12) << i;
  }
}

TEST(MountingTest, WithoutSpeedsOrWithoutMotionItSaysWhatToDo) {
  testing::DriveOptions options;
  options.rig.R_body_imu = Eigen::Quaterniond::Identity();
  options.wheels = false;
  EXPECT_THAT(FindMounting(testing::SimulateDrive(options, 1), Rig()),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("--rig")));
  options.wheels = true;
  options.rest_s = 1000.0;
  EXPECT_THAT(FindMounting(testing::SimulateDrive(options, 1), Rig()),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("moved too evenly")));
}

}  // namespace
}  // namespace strata
