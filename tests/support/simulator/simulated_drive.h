// A robot that drives a figure of eight over gentle hills, or another way, and what its sensors say
// of it.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATED_DRIVE_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATED_DRIVE_H_

#include <cstdint>
#include <filesystem>
#include <functional>

#include <Eigen/Geometry>

#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"
#include "core/geometry/pose.h"
#include "core/world/map_info.h"

namespace strata::testing {

struct DriveOptions {
  // Where the robot is after so many seconds at full speed; empty: on the figure of eight. Smooth,
  // and without a place that it stands at.
  std::function<Eigen::Vector3d(double driven_s)> way;
  double begin_s = 1000.0;
  double seconds = 120.0;
  double rest_s = 3.0;  // stands before it drives
  double imu_hz = 50.0, wheel_hz = 10.0, fix_hz = 2.0;
  bool wheels = true;
  double gps_sigma_m = 1.0;
  Rig rig;  // R_body_imu given; noise as its models say
  Eigen::Vector3d gyro_bias_rad_s = {0.004, -0.003, 0.006};
  Eigen::Vector3d accelerometer_bias_m_s2 = {0.05, -0.08, 0.04};
  double wheel_scale = 0.02;
  double yaw_mount_rad = 0.03;
  GeodeticOrigin origin = {0.82, 0.14, 400.0};  // of the truth's frame
};

// x east, y north at `origin`.
Pose TrueBodyPose(const DriveOptions& options, double time_s);

MotionLog SimulateDrive(const DriveOptions& options, std::uint64_t seed);

// imu.csv, odom.csv and gps.csv.
void WriteDrive(const MotionLog& log, const std::filesystem::path& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_SIMULATED_DRIVE_H_
