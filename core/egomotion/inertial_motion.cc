#include "core/egomotion/inertial_motion.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/screw_motion.h"
#include "core/geometry/skew.h"

namespace strata {
namespace {

using ByState = Eigen::Matrix<double, 3, kStateSize>;

// Walks of what hardly changes [1/√s, rad/√s].
constexpr double kWheelScaleWalk = 1e-4;
constexpr double kYawMountWalk = 1e-5;

Eigen::Matrix3d MountOf(const FusedState& state, const Eigen::Quaterniond& R_body_imu) {
  return So3Exp(state.yaw_mount_rad * Eigen::Vector3d::UnitZ()) * R_body_imu.toRotationMatrix();
}

// Of an IMU's reading in the body: by its bias and by the mount.
ByState ReadingDerivatives(const Eigen::Matrix3d& mount,
                           const Eigen::Vector3d& body,
                           StateIndex bias) {
  ByState J = ByState::Zero();
  J.middleCols<3>(bias) = -mount;
  J.col(kYawMount) = Eigen::Vector3d::UnitZ().cross(body);
  return J;
}

}  // namespace

BodyReading InBody(const FusedState& state,
                   const Eigen::Quaterniond& R_body_imu,
                   const ImuSample& reading) {
  const Eigen::Matrix3d mount = MountOf(state, R_body_imu);
  return {mount * (reading.angular_rate_rad_s - state.gyro_bias_rad_s),
          mount * (reading.specific_force_m_s2 - state.accelerometer_bias_m_s2)};
}

ByState AngularRateDerivatives(const FusedState& state,
                               const Eigen::Quaterniond& R_body_imu,
                               const BodyReading& body) {
  return ReadingDerivatives(MountOf(state, R_body_imu), body.angular_rate_rad_s, kGyroBias);
}

InertialStep Move(const FusedState& state,
                  const Eigen::Quaterniond& R_body_imu,
                  const ImuModel& imu,
                  const ImuSample& reading,
                  double duration_s) {
  const double dt = duration_s;
  const Eigen::Matrix3d mount = MountOf(state, R_body_imu);
  const BodyReading body = InBody(state, R_body_imu, reading);
  const Eigen::Vector3d& f = body.specific_force_m_s2;
  const Eigen::Vector3d turn = body.angular_rate_rad_s * dt;
  const Eigen::Matrix3d half = So3Exp(0.5 * turn);
  const Eigen::Matrix3d R_middle = state.R_map_body.toRotationMatrix() * half;
  const Eigen::Vector3d acceleration = R_middle * f - kGravityM_s2 * Eigen::Vector3d::UnitZ();

  InertialStep step;
  step.state = state;
  step.state.time_s += dt;
  step.state.R_map_body = (state.R_map_body * Eigen::Quaterniond(So3Exp(turn))).normalized();
  step.state.p_imu_m += dt * state.v_imu_m_s + 0.5 * dt * dt * acceleration;
  step.state.v_imu_m_s += dt * acceleration;

  const ByState by_rate = ReadingDerivatives(mount, body.angular_rate_rad_s, kGyroBias);
  const ByState by_force = ReadingDerivatives(mount, f, kAccelerometerBias);
  const Eigen::Matrix3d turned_by_rate = dt * So3RightJacobian(turn);
  const Eigen::Matrix3d middle_by_rate = 0.5 * dt * So3RightJacobian(0.5 * turn);
  // Acceleration by errors: of the rotation before, the rate, the force.
  const Eigen::Matrix3d by_rotation = -R_middle * Skew(f);
  ByState by_errors = by_rotation * middle_by_rate * by_rate + R_middle * by_force;
  by_errors.middleCols<3>(kRotation) += by_rotation * half.transpose();

  step.F.setIdentity();
  step.F.middleRows<3>(kRotation) += turned_by_rate * by_rate;
  step.F.block<3, 3>(kRotation, kRotation) = So3Exp(-turn);
  step.F.block<3, 3>(kPosition, kVelocity) += dt * Eigen::Matrix3d::Identity();
  step.F.middleRows<3>(kPosition) += 0.5 * dt * dt * by_errors;
  step.F.middleRows<3>(kVelocity) += dt * by_errors;

  step.G.setZero();
  step.G.block<3, 3>(kRotation, 0) = turned_by_rate;
  step.G.block<3, 3>(kPosition, 0) = 0.5 * dt * dt * by_rotation * middle_by_rate;
  step.G.block<3, 3>(kVelocity, 0) = dt * by_rotation * middle_by_rate;
  step.G.block<3, 3>(kPosition, 3) = 0.5 * dt * dt * R_middle;
  step.G.block<3, 3>(kVelocity, 3) = dt * R_middle;
  step.G.bottomRightCorner<8, 8>().setIdentity();
  step.variances << Eigen::Vector3d::Constant(imu.gyro_noise * imu.gyro_noise / dt),
      Eigen::Vector3d::Constant(imu.accelerometer_noise * imu.accelerometer_noise / dt),
      Eigen::Vector3d::Constant(imu.gyro_bias_walk * imu.gyro_bias_walk * dt),
      Eigen::Vector3d::Constant(imu.accelerometer_bias_walk * imu.accelerometer_bias_walk * dt),
      kWheelScaleWalk * kWheelScaleWalk * dt, kYawMountWalk * kYawMountWalk * dt;
  return step;
}

}  // namespace strata
