// What an IMU felt between two times as one relative motion (Forster, Carlone, Dellaert, Scaramuzza
// 2017), whatever the state at the first of them. Internal to core/egomotion, not installed.
#ifndef STRATA_CORE_EGOMOTION_SMOOTHING_PREINTEGRATION_H_
#define STRATA_CORE_EGOMOTION_SMOOTHING_PREINTEGRATION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

// In the axes of the IMU at the beginning, without gravity and the velocity of the beginning, for
// the biases it was made with.
struct InertialDelta {
  double duration_s = 0.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  // By the biases: the rotation's are right-hand rotation vectors.
  Eigen::Matrix3d rotation_by_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_by_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_by_accelerometer = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_accelerometer = Eigen::Matrix3d::Zero();
  // Of [rotation, velocity, position].
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
};

// `delta` and then `duration_s` > 0 of a steady reading; the force has the direction that it has in
// the middle, as in Move().
void Append(InertialDelta& delta,
            const ImuModel& imu,
            const Eigen::Vector3d& angular_rate_rad_s,
            const Eigen::Vector3d& specific_force_m_s2,
            double duration_s);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_SMOOTHING_PREINTEGRATION_H_
