#include "core/egomotion/smoothing/preintegration.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/geometry/screw_motion.h"
#include "core/geometry/skew.h"

namespace strata {

void Append(InertialDelta& delta,
            const ImuModel& imu,
            const Eigen::Vector3d& angular_rate_rad_s,
            const Eigen::Vector3d& specific_force_m_s2,
            double duration_s) {
  const double dt = duration_s;
  const Eigen::Vector3d turn = dt * (angular_rate_rad_s - delta.gyro_bias);
  const Eigen::Vector3d f = specific_force_m_s2 - delta.accelerometer_bias;
  const Eigen::Matrix3d half = So3Exp(0.5 * turn);
  const Eigen::Matrix3d R = delta.rotation.toRotationMatrix() * half;
  const Eigen::Vector3d way = R * f;
  // Rotation at the end by that at the beginning and by the rate; the force by both.
  const Eigen::Matrix3d turned_by_rotation = So3Exp(-turn);
  const Eigen::Matrix3d turned_by_rate = dt * So3RightJacobian(turn);
  const Eigen::Matrix3d way_by_rotation = -R * Skew(f) * half.transpose();
  const Eigen::Matrix3d way_by_rate = -R * Skew(f) * (0.5 * dt * So3RightJacobian(0.5 * turn));

  Eigen::Matrix<double, 9, 9> F = Eigen::Matrix<double, 9, 9>::Identity();
  F.block<3, 3>(0, 0) = turned_by_rotation;
  F.block<3, 3>(3, 0) = dt * way_by_rotation;
  F.block<3, 3>(6, 0) = 0.5 * dt * dt * way_by_rotation;
  F.block<3, 3>(6, 3) = dt * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 9, 6> G;
  G << turned_by_rate, Eigen::Matrix3d::Zero(), dt * way_by_rate, dt * R,
      0.5 * dt * dt * way_by_rate, 0.5 * dt * dt * R;
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(imu.gyro_noise * imu.gyro_noise / dt),
      Eigen::Vector3d::Constant(imu.accelerometer_noise * imu.accelerometer_noise / dt);
  delta.covariance =
      F * delta.covariance * F.transpose() + G * variances.asDiagonal() * G.transpose();

  // A bias is taken from the reading: its derivatives are those of noise with the other sign.
  const Eigen::Matrix3d acceleration_by_gyro =
      way_by_rotation * delta.rotation_by_gyro - way_by_rate;
  delta.position_by_gyro += dt * delta.velocity_by_gyro + 0.5 * dt * dt * acceleration_by_gyro;
  delta.position_by_accelerometer += dt * delta.velocity_by_accelerometer - 0.5 * dt * dt * R;
  delta.velocity_by_gyro += dt * acceleration_by_gyro;
  delta.velocity_by_accelerometer -= dt * R;
  delta.rotation_by_gyro = turned_by_rotation * delta.rotation_by_gyro - turned_by_rate;

  delta.position += dt * delta.velocity + 0.5 * dt * dt * way;
  delta.velocity += dt * way;
  delta.rotation = (delta.rotation * Eigen::Quaterniond(So3Exp(turn))).normalized();
  delta.duration_s += dt;
}

}  // namespace strata
