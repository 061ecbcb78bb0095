#include "core/egomotion/egomotion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "core/egomotion/geodesy.h"
#include "core/geometry/screw_motion.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

testing::DriveOptions CarDrive() {
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

// From the truth's frame into the run's, whose origin is its first fix.
Pose IntoMap(const Egomotion& run, const testing::DriveOptions& options) {
  const LocalFrame map(run.origin), truth(options.origin);
  Pose T = Pose::Identity();  // 100 m on a sphere: axes are parallel to 16 µrad
  T.translation() = map.ToMap(truth.ToEarth(Eigen::Vector3d::Zero()));
  return T;
}

struct Quality {
  double rms_m = 0.0;
  double nees = 0.0;  // of position and rotation, 6 degrees of freedom
  double worst_m = 0.0;
};

Quality Judge(const Egomotion& run, const testing::DriveOptions& options, double from_s) {
  const Pose T_map_truth = IntoMap(run, options);
  Quality quality;
  double count = 0.0;
  for (const TrajectoryPose& pose : run.trajectory.poses()) {
    if (pose.time_s < options.begin_s + from_s) continue;
    const Pose truth = T_map_truth * testing::TrueBodyPose(options, pose.time_s);
    const Vector6d error = TwistOf(pose.T_map_body.inverse() * truth);
    const double off_m = (truth.translation() - pose.T_map_body.translation()).norm();
    quality.rms_m += off_m * off_m;
    quality.worst_m = std::max(quality.worst_m, off_m);
    quality.nees += error.dot(pose.covariance.inverse() * error);
    count += 1.0;
  }
  quality.rms_m = std::sqrt(quality.rms_m / count);
  quality.nees /= count;
  return quality;
}

// Between those that are tried, too: 45 degrees lie from one to the next.
TEST(EgomotionTest, BeginsWithTheHeadingThatTheFirstMetresShow) {
  double squares = 0.0;
  constexpr int kDrives = 8;
  for (int k = 0; k < kDrives; ++k) {
    testing::DriveOptions options = CarDrive();
    options.seconds = 40.0;
    options.rest_s = k % 2 == 0 ? 3.0 : 0.0;
    const double turn_rad = 0.35 + 0.8 * k;
    options.way = [turn_rad](double driven_s) -> Eigen::Vector3d {
      const Eigen::Vector3d p(3.0 * driven_s, 20.0 * (1.0 - std::cos(0.1 * driven_s)), 0.0);
      return Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * p;
    };
    const MotionLog log = testing::SimulateDrive(options, 300 + k);
    STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig));
    const double off_rad =
        std::remainder(run.report.heading_at_start_rad - turn_rad, 2.0 * std::numbers::pi);
    EXPECT_LT(std::abs(off_rad), 0.25) << k;
    squares += off_rad * off_rad / kDrives;
  }
  EXPECT_LT(std::sqrt(squares), 0.1);
}

TEST(EgomotionTest, TellsPosesAsTheyBecomeKnown) {
  const testing::DriveOptions options = CarDrive();
  const MotionLog log = testing::SimulateDrive(options, 4);
  EgomotionOptions asked;
  asked.origin = options.origin;
  std::size_t told = 0, poses = 0;
  double last_s = 0.0;
  asked.told = [&](const EgomotionSoFar& run) {
    EXPECT_GE(run.poses.size(), poses);
    poses = run.poses.size();
    last_s = run.poses.back().time_s;
    ++told;
    return absl::OkStatus();
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig, asked));
  EXPECT_EQ(run.origin, options.origin);
  EXPECT_EQ(poses, run.trajectory.poses().size());
  EXPECT_EQ(last_s, log.imu.back().time_s);
  EXPECT_GT(told, 90U);  // of 120 s
  asked.told = [](const EgomotionSoFar&) { return absl::UnavailableError("enough"); };
  EXPECT_THAT(FilterLog(log, options.rig, asked),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("enough")));
  asked.origin->latitude_rad += 0.1;
  EXPECT_THAT(FilterLog(log, options.rig, asked),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("from the map's origin")));
}

TEST(EgomotionTest, FollowsADrivenRobot) {
  double nees = 0.0;
  constexpr int kDrives = 8;
  for (int seed = 1; seed <= kDrives; ++seed) {
    const testing::DriveOptions options = CarDrive();
    const MotionLog log = testing::SimulateDrive(options, 100 * seed);
    STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig));
    const Quality quality = Judge(run, options, 30.0);
    EXPECT_LT(quality.rms_m, 0.6) << seed;
    nees += quality.nees / kDrives;
    const EgomotionReport& report = run.report;
    EXPECT_TRUE(report.rested_at_start);
    EXPECT_EQ(report.fixes, log.fixes.size());
    EXPECT_EQ(report.used + report.rejected, report.fixes);
    EXPECT_LT(report.rejected, 5U) << seed;
    EXPECT_TRUE(report.recoveries.empty());
    EXPECT_TRUE(report.gaps.empty());
    EXPECT_NEAR(report.mean_nis, 2.0, 0.5) << seed;
    const auto expect_near = [&](double value, double truth, int index) {
      EXPECT_NEAR(value, truth, 4.0 * report.last_sigma(index)) << index << " " << seed;
    };
    for (int k = 0; k < 3; ++k) {
      expect_near(report.last.gyro_bias_rad_s(k), options.gyro_bias_rad_s(k), kGyroBias + k);
      expect_near(report.last.accelerometer_bias_m_s2(k),
                  options.accelerometer_bias_m_s2(k),
                  kAccelerometerBias + k);
    }
    expect_near(report.last.wheel_scale, options.wheel_scale, kWheelScale);
    expect_near(report.last.yaw_mount_rad, options.yaw_mount_rad, kYawMount);
  }
  EXPECT_GT(nees, 3.0);
  EXPECT_LT(nees, 12.0);
}

TEST(EgomotionTest, NeedsNeitherWheelsNorRest) {
  testing::DriveOptions options = CarDrive();
  options.wheels = false;
  options.rest_s = 0.0;
  const MotionLog log = testing::SimulateDrive(options, 7);
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig));
  EXPECT_FALSE(run.report.rested_at_start);
  EXPECT_LT(Judge(run, options, 60.0).rms_m, 1.6);  // of a fix: 1.73 m
}

TEST(EgomotionTest, GapsAreDrivenThrough) {
  const testing::DriveOptions options = CarDrive();
  MotionLog log = testing::SimulateDrive(options, 8);
  std::erase_if(log.fixes, [&](const GpsFix& fix) {
    return fix.time_s > options.begin_s + 60.0 && fix.time_s < options.begin_s + 90.0;
  });
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig));
  ASSERT_EQ(run.report.gaps.size(), 1U);
  EXPECT_NEAR(run.report.gaps[0].end_s - run.report.gaps[0].begin_s, 30.0, 1.1);
  EXPECT_LT(Judge(run, options, 30.0).worst_m, 3.0);
}

TEST(EgomotionTest, JumpsAreRejectedAndTheRestKept) {
  const testing::DriveOptions options = CarDrive();
  MotionLog log = testing::SimulateDrive(options, 9);
  constexpr double kNorth = 15.0 / 6.37e6;
  std::size_t planted = 0;
  for (std::size_t i = 80; i < log.fixes.size(); i += 13, ++planted) {
    log.fixes[i].latitude_rad += kNorth;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig));
  for (std::size_t i = 80; i < log.fixes.size(); i += 13) EXPECT_FALSE(run.fixes[i].used) << i;
  EXPECT_LT(run.report.rejected, planted + 5);
  EXPECT_LT(Judge(run, options, 30.0).rms_m, 0.6);
}

// A gate alone rejects for ever once the heading is wrong.
TEST(EgomotionTest, RecoversFromAWrongHeading) {
  const testing::DriveOptions options = CarDrive();
  const MotionLog log = testing::SimulateDrive(options, 10);
  EgomotionOptions wrong;
  wrong.heading_rad = std::atan2(80.0, 60.0) + 2.0;  // the drive's first direction, and 115°
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion run, FilterLog(log, options.rig, wrong));
  ASSERT_FALSE(run.report.recoveries.empty());
  EXPECT_GT(run.report.used, run.report.fixes / 2);
  EXPECT_LT(Judge(run, options, 60.0).rms_m, 0.8);
}

TEST(EgomotionTest, TheSameLogGivesTheSameBytes) {
  const testing::DriveOptions options = CarDrive();
  const MotionLog log = testing::SimulateDrive(options, 11);
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion a, FilterLog(log, options.rig));
  STRATA_ASSERT_OK_AND_ASSIGN(const Egomotion b, FilterLog(log, options.rig));
  const TrajectoryPose &last_a = a.trajectory.poses().back(), &last_b = b.trajectory.poses().back();
  EXPECT_EQ(last_a.T_map_body.matrix(), last_b.T_map_body.matrix());
  EXPECT_EQ(last_a.covariance, last_b.covariance);
}

TEST(EgomotionTest, RefusesLogsThatSayWhy) {
  const testing::DriveOptions options = CarDrive();
  const MotionLog good = testing::SimulateDrive(options, 12);
  const auto expect = [&](const std::function<void(MotionLog&)>& spoil, const char* message) {
    MotionLog log = good;
    spoil(log);
    EXPECT_THAT(FilterLog(log, options.rig),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect([](MotionLog& log) { log.imu.clear(); }, "IMU: the log has no two samples");
  expect([](MotionLog& log) { log.fixes.clear(); }, "GPS: the log has no fix");
  expect([](MotionLog& log) { log.imu[7].time_s = log.imu[6].time_s; },
         "IMU: sample 7 at 1000.120000 s is not later");
  expect([](MotionLog& log) { log.imu[7].specific_force_m_s2.x() = NAN; },
         "IMU: sample 7 holds a number that cannot be");
  expect([](MotionLog& log) { log.wheels[3].speed_m_s = INFINITY; }, "wheels: sample 3");
  expect([](MotionLog& log) { log.fixes[2].latitude_rad = 4.0; }, "GPS: sample 2");
  expect([](MotionLog& log) { log.imu.erase(log.imu.begin() + 100, log.imu.begin() + 200); },
         "IMU: silent for 2.020 s from 1001.980000 s on");
  Rig rig = options.rig;
  rig.imu.gyro_noise = 0.0;
  EXPECT_THAT(FilterLog(good, rig),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("imu.gyro_noise is 0")));
  Stop stop;
  stop.Request();
  EXPECT_THAT(FilterLog(good, options.rig, {}, stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
