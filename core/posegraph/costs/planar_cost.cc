#include "core/posegraph/costs/planar_cost.h"

#include <cmath>

#include <Eigen/Core>

#include "core/posegraph/costs/information_root.h"

namespace strata {
namespace {

Eigen::Matrix2d Turn(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  Eigen::Matrix2d R;
  R << c, -s, s, c;
  return R;
}

void WriteJacobian(const Eigen::Matrix3d& by_step, double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> out(jacobian);
  out = by_step;
}

}  // namespace

double WrapAngle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * M_PI);
  return wrapped <= -M_PI ? M_PI : wrapped;
}

Eigen::Vector3d PlanarError(const PlanarPose& i, const PlanarPose& j, const PlanarPose& T_i_j) {
  const Eigen::Vector2d seen = Turn(i.z()).transpose() * (j.head<2>() - i.head<2>());
  Eigen::Vector3d error;
  error.head<2>() = Turn(T_i_j.z()).transpose() * (seen - T_i_j.head<2>());
  error.z() = WrapAngle(j.z() - i.z() - T_i_j.z());
  return error;
}

PlanarDerivatives DifferentiatePlanar(const PlanarPose& i,
                                      const PlanarPose& j,
                                      const PlanarPose& T_i_j) {
  const Eigen::Vector2d seen = Turn(i.z()).transpose() * (j.head<2>() - i.head<2>());
  const Eigen::Matrix2d R_j_i = Turn(-T_i_j.z());
  PlanarDerivatives result;
  result.error.head<2>() = R_j_i * (seen - T_i_j.head<2>());
  result.error.z() = WrapAngle(j.z() - i.z() - T_i_j.z());
  result.by_i.setZero();
  result.by_i.topLeftCorner<2, 2>() = -R_j_i;
  result.by_i.topRightCorner<2, 1>() = R_j_i * Eigen::Vector2d(seen.y(), -seen.x());
  result.by_i(2, 2) = -1.0;
  result.by_j.setZero();
  result.by_j.topLeftCorner<2, 2>() = Turn(j.z() - i.z() - T_i_j.z());
  result.by_j(2, 2) = 1.0;
  return result;
}

PlanarRelativeCost::PlanarRelativeCost(const PlanarPose& T_i_j,
                                       const Eigen::Matrix3d& information,
                                       const double* weight)
    : T_i_j_(T_i_j), root_(InformationRoot(information)), weight_(weight) {}

bool PlanarRelativeCost::Evaluate(double const* const* blocks,
                                  double* residuals,
                                  double** jacobians) const {
  const PlanarPose i(blocks[0]);
  const PlanarPose j(blocks[1]);
  const Eigen::Matrix3d root = std::sqrt(*weight_) * root_;
  Eigen::Map<Eigen::Vector3d> weighted(residuals);
  if (jacobians == nullptr) {
    weighted = root * PlanarError(i, j, T_i_j_);
    return weighted.allFinite();
  }
  const PlanarDerivatives d = DifferentiatePlanar(i, j, T_i_j_);
  weighted = root * d.error;
  if (jacobians[0] != nullptr) WriteJacobian(root * d.by_i, jacobians[0]);
  if (jacobians[1] != nullptr) WriteJacobian(root * d.by_j, jacobians[1]);
  return weighted.allFinite();
}

PlanarPose Moved(const PlanarPose& pose, const Eigen::Vector3d& step) {
  const double angle = step.z();
  double along = 1.0 - angle * angle / 6.0;  // sin(angle) / angle
  double across = 0.5 * angle;               // (1 − cos(angle)) / angle
  if (std::abs(angle) > 1e-4) {
    along = std::sin(angle) / angle;
    across = (1.0 - std::cos(angle)) / angle;
  }
  const Eigen::Vector2d arc(along * step.x() - across * step.y(),
                            across * step.x() + along * step.y());
  PlanarPose moved;
  moved.head<2>() = pose.head<2>() + Turn(pose.z()) * arc;
  moved.z() = WrapAngle(pose.z() + angle);
  return moved;
}

}  // namespace strata
