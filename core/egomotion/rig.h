// How the sensors sit on a robot and how good they are. The body frame is that of the wheels: x
// forward, y left, z up, its origin where the robot does not slip sideways (the rear axle of a
// car).
#ifndef STRATA_CORE_EGOMOTION_RIG_H_
#define STRATA_CORE_EGOMOTION_RIG_H_

#include <optional>

#include "absl/status/status.h"
#include <Eigen/Geometry>

namespace strata {

// White noise by the root of its power density, and biases that walk.
struct ImuModel {
  double gyro_noise = 0.02;               // rad/s/√Hz, vibration included; (0, 1]
  double accelerometer_noise = 0.1;       // m/s²/√Hz, vibration included; (0, 10]
  double gyro_bias_rad_s = 0.01;          // σ at the start; (0, 1]
  double accelerometer_bias_m_s2 = 0.2;   // σ at the start; (0, 10]
  double gyro_bias_walk = 1e-4;           // rad/s/√s; (0, 1]
  double accelerometer_bias_walk = 1e-3;  // m/s²/√s; (0, 1]
};

// σ of one sample. Slip lasts for longer than a sample: these are larger than an encoder's.
struct WheelModel {
  double speed_m_s = 0.3;        // (0, 10]
  double side_slip_m_s = 0.5;    // (0, 10]
  double climb_m_s = 0.5;        // across the ground; (0, 10]
  double yaw_rate_rad_s = 0.05;  // (0, 10]
  double yaw_rate_share = 0.3;   // of the rate, on top; [0, 10]
  double scale = 0.05;           // σ of the speed's scale at the start; (0, 1]
  double lag_s = 0.0;            // by which samples are stamped late; [-10, 10]
};

struct GpsModel {
  Eigen::Vector3d antenna_body_m = Eigen::Vector3d::Zero();
  double least_sigma_m = 0.3;  // below it no receiver is believed; [0.01, 100]
  double lag_s = 0.0;          // [-10, 10]
};

struct Rig {
  // Axes of the IMU in the body; nullopt: found from the log (FindMounting).
  std::optional<Eigen::Quaterniond> R_body_imu;
  Eigen::Vector3d imu_body_m = Eigen::Vector3d::Zero();
  double yaw_mount_rad = 0.1;  // σ of R_body_imu about z at the start; (0, π]
  ImuModel imu;
  WheelModel wheels;
  GpsModel gps;
};

// INVALID_ARGUMENT naming the fields out of range.
absl::Status ValidateRig(const Rig& rig);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_RIG_H_
