#include "core/egomotion/measurements.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/skew.h"

namespace strata {
namespace {

// σ of a standing robot: it shakes with its motor.
constexpr double kRestSpeedM_s = 0.02;
constexpr double kRestRateRad_s = 0.005;

}  // namespace

StateMeasurement<3> MeasurePosition(const FusedState& state,
                                    const Rig& rig,
                                    const Eigen::Vector3d& p_antenna_map_m,
                                    const Eigen::Vector3d& sigma_m) {
  const Eigen::Matrix3d R = state.R_map_body.toRotationMatrix();
  const Eigen::Vector3d arm = rig.gps.antenna_body_m - rig.imu_body_m;
  StateMeasurement<3> m;
  m.residual = p_antenna_map_m - state.p_imu_m - R * arm;
  m.H.setZero();
  m.H.middleCols<3>(kRotation) = -R * Skew(arm);
  m.H.middleCols<3>(kPosition).setIdentity();
  m.covariance = sigma_m.cwiseMax(rig.gps.least_sigma_m).cwiseAbs2().asDiagonal();
  return m;
}

StateMeasurement<3> MeasureSpeed(const FusedState& state,
                                 const Rig& rig,
                                 const Eigen::Quaterniond& mount,
                                 const BodyReading& body,
                                 double speed_m_s) {
  const Eigen::Matrix3d R_body_map = state.R_map_body.toRotationMatrix().transpose();
  const Eigen::Vector3d v_imu = R_body_map * state.v_imu_m_s;
  const Eigen::Vector3d v = v_imu - body.angular_rate_rad_s.cross(rig.imu_body_m);
  StateMeasurement<3> m;
  // −δω × arm = [arm]ₓ δω.
  m.H = Skew(rig.imu_body_m) * AngularRateDerivatives(state, mount, body);
  m.H.middleCols<3>(kRotation) += Skew(v_imu);
  m.H.middleCols<3>(kVelocity) += R_body_map;
  m.H.row(0) *= 1.0 + state.wheel_scale;
  m.H(0, kWheelScale) += v.x();
  m.residual << speed_m_s - (1.0 + state.wheel_scale) * v.x(), -v.y(), -v.z();
  m.covariance =
      Eigen::Vector3d(rig.wheels.speed_m_s, rig.wheels.side_slip_m_s, rig.wheels.climb_m_s)
          .cwiseAbs2()
          .asDiagonal();
  return m;
}

StateMeasurement<1> MeasureYawRate(const FusedState& state,
                                   const Rig& rig,
                                   const Eigen::Quaterniond& mount,
                                   const BodyReading& body,
                                   double yaw_rate_rad_s) {
  const double sigma =
      rig.wheels.yaw_rate_rad_s + rig.wheels.yaw_rate_share * std::abs(yaw_rate_rad_s);
  StateMeasurement<1> m;
  m.residual(0) = yaw_rate_rad_s - body.angular_rate_rad_s.z();
  m.H = AngularRateDerivatives(state, mount, body).row(2);
  m.covariance(0) = sigma * sigma;
  return m;
}

StateMeasurement<6> MeasureRest(const FusedState& state,
                                const Eigen::Quaterniond& mount,
                                const BodyReading& body) {
  StateMeasurement<6> m;
  m.residual << -state.v_imu_m_s, -body.angular_rate_rad_s;
  m.H.setZero();
  m.H.block<3, 3>(0, kVelocity).setIdentity();
  m.H.bottomRows<3>() = AngularRateDerivatives(state, mount, body);
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kRestSpeedM_s), Eigen::Vector3d::Constant(kRestRateRad_s);
  m.covariance = sigma.cwiseAbs2().asDiagonal();
  return m;
}

}  // namespace strata
