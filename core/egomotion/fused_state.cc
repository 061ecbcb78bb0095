#include "core/egomotion/fused_state.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/skew.h"

namespace strata {

FusedState Retract(const FusedState& state, const StateVector& step) {
  FusedState moved = state;
  const Eigen::Vector3d rotation = step.segment<3>(kRotation);
  moved.R_map_body = (state.R_map_body * Eigen::Quaterniond(So3Exp(rotation))).normalized();
  moved.p_imu_m += step.segment<3>(kPosition);
  moved.v_imu_m_s += step.segment<3>(kVelocity);
  moved.gyro_bias_rad_s += step.segment<3>(kGyroBias);
  moved.accelerometer_bias_m_s2 += step.segment<3>(kAccelerometerBias);
  moved.wheel_scale += step(kWheelScale);
  moved.yaw_mount_rad += step(kYawMount);
  return moved;
}

StateVector Difference(const FusedState& from, const FusedState& to) {
  StateVector step;
  step.segment<3>(kRotation) =
      So3Log((from.R_map_body.conjugate() * to.R_map_body).toRotationMatrix());
  step.segment<3>(kPosition) = to.p_imu_m - from.p_imu_m;
  step.segment<3>(kVelocity) = to.v_imu_m_s - from.v_imu_m_s;
  step.segment<3>(kGyroBias) = to.gyro_bias_rad_s - from.gyro_bias_rad_s;
  step.segment<3>(kAccelerometerBias) = to.accelerometer_bias_m_s2 - from.accelerometer_bias_m_s2;
  step(kWheelScale) = to.wheel_scale - from.wheel_scale;
  step(kYawMount) = to.yaw_mount_rad - from.yaw_mount_rad;
  return step;
}

Pose BodyPose(const FusedState& state, const Eigen::Vector3d& imu_body_m) {
  return MakePose(state.R_map_body, state.p_imu_m - state.R_map_body * imu_body_m);
}

Matrix6d BodyCovariance(const FusedState& state,
                        const StateMatrix& covariance,
                        const Eigen::Vector3d& imu_body_m) {
  Matrix6d J = Matrix6d::Identity();
  J.bottomLeftCorner<3, 3>() = Skew(imu_body_m);
  J.bottomRightCorner<3, 3>() = state.R_map_body.toRotationMatrix().transpose();
  const Matrix6d rotated = J * covariance.topLeftCorner<6, 6>() * J.transpose();
  return 0.5 * (rotated + rotated.transpose());
}

}  // namespace strata
