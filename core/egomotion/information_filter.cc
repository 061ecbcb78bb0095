#include "core/egomotion/information_filter.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace strata {

void InformationFilter::Predict(const ImuSample& reading, double time_s) {
  const double duration_s = time_s - state_.time_s;
  if (duration_s <= 0.0) return;
  const InertialStep step = Move(state_, *rig_->R_body_imu, rig_->imu, reading, duration_s);
  form_.Predict(step.F, step.G, step.variances);
  state_ = step.state;
  state_.time_s = time_s;
}

void InformationFilter::Relocate(const Relocation& relocation) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(relocation.yaw_rad, Eigen::Vector3d::UnitZ()));
  state_.R_map_body = (turn * state_.R_map_body).normalized();
  state_.v_imu_m_s = turn * state_.v_imu_m_s;
  state_.p_imu_m = turn * (state_.p_imu_m - relocation.pivot_m) + relocation.target_m;
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(kStateSize, kStateSize);
  J.block<3, 3>(kPosition, kPosition).setZero();
  J.block<3, 3>(kVelocity, kVelocity) = turn.toRotationMatrix();
  const Eigen::MatrixXd PJ = form_.Covariance() * J.transpose();
  Eigen::MatrixXd P = J * PJ;
  P.block<3, 3>(kPosition, kPosition) = relocation.sigma_m.cwiseAbs2().asDiagonal();
  Eigen::VectorXd by_yaw = Eigen::VectorXd::Zero(kStateSize);
  by_yaw.segment<3>(kRotation) = state_.R_map_body.conjugate() * Eigen::Vector3d::UnitZ();
  by_yaw.segment<3>(kVelocity) = Eigen::Vector3d::UnitZ().cross(state_.v_imu_m_s);
  P += relocation.sigma_yaw_rad * relocation.sigma_yaw_rad * by_yaw * by_yaw.transpose();
  form_ = InformationForm(P);
}

}  // namespace strata
