#include "core/egomotion/rig.h"

#include <numbers>

#include "absl/status/status.h"

#include "core/common/option_checks.h"

namespace strata {
namespace {

constexpr double kTiny = 1e-9;
constexpr double kMaxArmM = 100.0;

void CheckArm(OptionChecks& checks, const char* field, const Eigen::Vector3d& arm_m) {
  for (const double number : arm_m) checks.InRange(field, number, -kMaxArmM, kMaxArmM);
}

}  // namespace

absl::Status ValidateRig(const Rig& rig) {
  OptionChecks checks("rig");
  CheckArm(checks, "imu.position", rig.imu_body_m);
  CheckArm(checks, "gps.antenna", rig.gps.antenna_body_m);
  checks.InRange("imu.yaw_mount", rig.yaw_mount_rad, kTiny, std::numbers::pi);
  checks.InRange("imu.gyro_noise", rig.imu.gyro_noise, kTiny, 1.0);
  checks.InRange("imu.accelerometer_noise", rig.imu.accelerometer_noise, kTiny, 10.0);
  checks.InRange("imu.gyro_bias", rig.imu.gyro_bias_rad_s, kTiny, 1.0);
  checks.InRange("imu.accelerometer_bias", rig.imu.accelerometer_bias_m_s2, kTiny, 10.0);
  checks.InRange("imu.gyro_bias_walk", rig.imu.gyro_bias_walk, kTiny, 1.0);
  checks.InRange("imu.accelerometer_bias_walk", rig.imu.accelerometer_bias_walk, kTiny, 1.0);
  checks.InRange("wheels.speed", rig.wheels.speed_m_s, kTiny, 10.0);
  checks.InRange("wheels.side_slip", rig.wheels.side_slip_m_s, kTiny, 10.0);
  checks.InRange("wheels.climb", rig.wheels.climb_m_s, kTiny, 10.0);
  checks.InRange("wheels.yaw_rate", rig.wheels.yaw_rate_rad_s, kTiny, 10.0);
  checks.InRange("wheels.yaw_rate_share", rig.wheels.yaw_rate_share, 0.0, 10.0);
  checks.InRange("wheels.scale", rig.wheels.scale, kTiny, 1.0);
  checks.InRange("wheels.lag", rig.wheels.lag_s, -10.0, 10.0);
  checks.InRange("gps.least_sigma", rig.gps.least_sigma_m, 0.01, 100.0);
  checks.InRange("gps.lag", rig.gps.lag_s, -10.0, 10.0);
  return checks.status();
}

}  // namespace strata
