#include "core/world/tracking.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

TEST(TrackStartTest, NamesWhatIsWrong) {
  TrackStart start;
  STRATA_EXPECT_OK(ValidateTrackStart(start));
  start.guess_radius_m = 0.0;
  EXPECT_THAT(ValidateTrackStart(start), StatusIs(kInvalid, HasSubstr("guess_radius_m")));
  start = TrackStart();
  start.T_map_scan_guess = Pose::Identity();
  start.T_map_scan_guess->translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ValidateTrackStart(start), StatusIs(kInvalid, HasSubstr("guess")));
}

TEST(TrackStepTest, OdometryAloneIsAStep) { STRATA_EXPECT_OK(ValidateTrackStep(TrackStep())); }

TEST(TrackStepTest, NamesWhatIsWrong) {
  TrackStep step;
  step.T_odom_scan.linear() *= 2.0;
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("odometry")));
  step = TrackStep();
  step.cloud.points = {{1.0F, std::numeric_limits<float>::infinity(), 0.0F}};
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("point")));
  STRATA_EXPECT_OK(ValidateTrackMotion(step));
  step = TrackStep();
  step.cloud.origin.x() = 1.0;
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("origin")));
}

TEST(TrackStepTest, ACovarianceIsSymmetricAndPositive) {
  TrackStep step;
  step.motion_covariance = 0.01 * Matrix6d::Identity();
  STRATA_EXPECT_OK(ValidateTrackStep(step));
  (*step.motion_covariance)(0, 1) = 0.001;
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("covariance")));
  step.motion_covariance = Matrix6d::Zero();
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("covariance")));
  step.motion_covariance = Matrix6d::Identity();
  (*step.motion_covariance)(3, 3) = -1.0;
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("covariance")));
  (*step.motion_covariance)(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("covariance")));
  (*step.motion_covariance)(3, 3) = 1e13;
  EXPECT_THAT(ValidateTrackStep(step), StatusIs(kInvalid, HasSubstr("covariance")));
}

}  // namespace
}  // namespace strata
