// What the filter and the smoother estimate, and the order of its errors.
#ifndef STRATA_CORE_EGOMOTION_FUSED_STATE_H_
#define STRATA_CORE_EGOMOTION_FUSED_STATE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata {

// Where each error stands: the rotation is a right-hand step of R_map_body, the yaw of the mount a
// turn about the body's z on the left of R_body_imu, all others are added.
enum StateIndex : int {
  kRotation = 0,
  kPosition = 3,
  kVelocity = 6,
  kGyroBias = 9,
  kAccelerometerBias = 12,
  kWheelScale = 15,
  kYawMount = 16,
  kStateSize = 17,
};

using StateVector = Eigen::Matrix<double, kStateSize, 1>;
using StateMatrix = Eigen::Matrix<double, kStateSize, kStateSize>;

struct FusedState {
  double time_s = 0.0;
  Eigen::Quaterniond R_map_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_imu_m = Eigen::Vector3d::Zero();          // place of the IMU in the map
  Eigen::Vector3d v_imu_m_s = Eigen::Vector3d::Zero();        // its velocity in the axes of the map
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  // in the axes of the IMU
  Eigen::Vector3d accelerometer_bias_m_s2 = Eigen::Vector3d::Zero();  // likewise
  double wheel_scale = 0.0;  // wheels say (1 + wheel_scale) times the speed
  double yaw_mount_rad = 0.0;
};

FusedState Retract(const FusedState& state, const StateVector& step);

// The error `step` with Retract(from, step) = to.
StateVector Difference(const FusedState& from, const FusedState& to);

// The pose of the body, whose IMU is at `imu_body_m`.
Pose BodyPose(const FusedState& state, const Eigen::Vector3d& imu_body_m);

// The covariance of a right-hand step [rotation, translation] of BodyPose() from that of the
// state's errors.
Matrix6d BodyCovariance(const FusedState& state,
                        const StateMatrix& covariance,
                        const Eigen::Vector3d& imu_body_m);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_FUSED_STATE_H_
