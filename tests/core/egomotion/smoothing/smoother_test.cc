#include "core/egomotion/smoothing/smoother.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "core/egomotion/egomotion.h"
#include "core/egomotion/geodesy.h"
#include "core/geometry/screw_motion.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

testing::DriveOptions SmoothDrive() {
  testing::DriveOptions options;
  options.rig.R_body_imu = Eigen::Quaterniond(So3Exp({0.5, -0.8, 1.2}));
  options.rig.imu_body_m = {0.3, -0.1, 0.6};
  options.rig.gps.antenna_body_m = {-0.4, 0.2, 1.5};
  options.rig.wheels.speed_m_s = 0.1;
  options.rig.wheels.side_slip_m_s = 0.05;  // there is none
  options.rig.wheels.climb_m_s = 0.05;
  options.rig.imu.gyro_noise = 1e-3;
  options.rig.imu.accelerometer_noise = 0.02;
  return options;
}

struct Errors {
  double rms_m = 0.0, nees = 0.0;
};

Errors ErrorsOf(const Egomotion& run,
                const testing::DriveOptions& options,
                double from_s,
                double to_s) {
  Pose T_map_truth = Pose::Identity();
  T_map_truth.translation() =
      LocalFrame(run.origin).ToMap(LocalFrame(options.origin).ToEarth(Eigen::Vector3d::Zero()));
  Errors errors;
  double count = 0.0;
  for (const TrajectoryPose& pose : run.trajectory.poses()) {
    if (pose.time_s < options.begin_s + from_s || pose.time_s > options.begin_s + to_s) continue;
    const Pose truth = T_map_truth * testing::TrueBodyPose(options, pose.time_s);
    const Vector6d error = TwistOf(pose.T_map_body.inverse() * truth);
    errors.rms_m += (truth.translation() - pose.T_map_body.translation()).squaredNorm();
    errors.nees += error.dot(pose.covariance.inverse() * error);
    count += 1.0;
  }
  return {std::sqrt(errors.rms_m / count), errors.nees / count};
}

TEST(SmootherTest, IsBetterThanTheFilterAboveAllInGaps) {
  double filter_gap = 0.0, smooth_gap = 0.0, filter_all = 0.0, smooth_all = 0.0, nees = 0.0;
  constexpr int kDrives = 4;
  for (int seed = 1; seed <= kDrives; ++seed) {
    const testing::DriveOptions options = SmoothDrive();
    MotionLog log = testing::SimulateDrive(options, 1000 * seed);
    std::erase_if(log.fixes, [&](const GpsFix& fix) {
      return fix.time_s > options.begin_s + 60.0 && fix.time_s < options.begin_s + 90.0;
    });
    STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion filtered, FilterLog(log, options.rig));
    STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion smooth, SmoothLog(log, options.rig, filtered));
    EXPECT_EQ(smooth.trajectory.poses().size(), smooth.states.size());
    EXPECT_EQ(smooth.fixes.size(), filtered.fixes.size());
    EXPECT_NEAR(static_cast<double>(smooth.states.size()),
                static_cast<double>(filtered.states.size()),
                1.0);
    filter_gap += ErrorsOf(filtered, options, 60.0, 90.0).rms_m;
    smooth_gap += ErrorsOf(smooth, options, 60.0, 90.0).rms_m;
    filter_all += ErrorsOf(filtered, options, 10.0, 120.0).rms_m;
    const Errors all = ErrorsOf(smooth, options, 0.0, 120.0);
    smooth_all += all.rms_m;
    nees += all.nees / kDrives;
    const EgomotionReport& report = smooth.report;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(report.last.gyro_bias_rad_s(k),
                  options.gyro_bias_rad_s(k),
                  4.0 * report.last_sigma(kGyroBias + k));
    }
    EXPECT_NEAR(report.last.wheel_scale, options.wheel_scale, 4.0 * report.last_sigma(kWheelScale));
  }
  EXPECT_LT(smooth_gap, 0.8 * filter_gap);
  EXPECT_LT(smooth_all, 0.8 * filter_all);
  EXPECT_GT(nees, 2.0);
  EXPECT_LT(nees, 12.0);
}

TEST(SmootherTest, FixesThatWalkOffCountLess) {
  const testing::DriveOptions options = SmoothDrive();
  MotionLog log = testing::SimulateDrive(options, 3);
  for (GpsFix& fix : log.fixes) {  // 0.4 m more each second for 30 s: no step is conspicuous
    const double walked_s = std::clamp(fix.time_s - options.begin_s - 60.0, 0.0, 30.0);
    if (walked_s < 30.0) fix.latitude_rad += 0.4 * walked_s / 6.37e6;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion filtered, FilterLog(log, options.rig));
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion smooth, SmoothLog(log, options.rig, filtered));
  EXPECT_LT(ErrorsOf(smooth, options, 60.0, 90.0).rms_m,
            0.6 * ErrorsOf(filtered, options, 60.0, 90.0).rms_m);
}

TEST(SmootherTest, TheSameLogGivesTheSamePosesAndAStopEndsIt) {
  testing::DriveOptions options = SmoothDrive();
  options.seconds = 40.0;
  const MotionLog log = testing::SimulateDrive(options, 4);
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion filtered, FilterLog(log, options.rig));
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion a, SmoothLog(log, options.rig, filtered));
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion b, SmoothLog(log, options.rig, filtered));
  for (std::size_t i = 0; i < a.trajectory.poses().size(); ++i) {
    ASSERT_EQ(a.trajectory.poses()[i].T_map_body.matrix(),
              b.trajectory.poses()[i].T_map_body.matrix());
    // SuiteSparse's QR rounds as its threads come.
    const Matrix6d& covariance = a.trajectory.poses()[i].covariance;
    ASSERT_TRUE(covariance.isApprox(b.trajectory.poses()[i].covariance, 1e-6));
  }
  const Stop stop;
  stop.Request();
  EXPECT_THAT(SmoothLog(log, options.rig, filtered, stop),
              testing::StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
