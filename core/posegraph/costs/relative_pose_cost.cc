#include "core/posegraph/costs/relative_pose_cost.h"

#include <cmath>

#include <Eigen/Geometry>

#include "core/geometry/skew.h"
#include "core/posegraph/costs/information_root.h"
#include "core/posegraph/costs/pose_block.h"

namespace strata {
namespace {

Eigen::Quaterniond Upper(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

}  // namespace

Vector6d RelativePoseError(const Pose& T_i, const Pose& T_j, const Pose& T_i_j) {
  const Eigen::Matrix3d R_j_i = T_i_j.inverse().linear();
  const Eigen::Matrix3d R = R_j_i * (T_i.linear().transpose() * T_j.linear());
  const Eigen::Vector3d t = T_i.linear().transpose() * (T_j.translation() - T_i.translation());
  Vector6d error;
  error.head<3>() = 2.0 * Upper(R).vec();
  error.tail<3>() = R_j_i * (t - T_i_j.translation());
  return error;
}

RelativePoseDerivatives DifferentiateRelativePose(const Pose& T_i,
                                                  const Pose& T_j,
                                                  const Pose& T_i_j) {
  const Eigen::Matrix3d R_j_i = T_i_j.inverse().linear();
  const Eigen::Matrix3d R = R_j_i * (T_i.linear().transpose() * T_j.linear());
  const Eigen::Vector3d t = T_i.linear().transpose() * (T_j.translation() - T_i.translation());
  const Eigen::Quaterniond q = Upper(R);
  const Eigen::Matrix3d scalar = Eigen::Vector3d::Constant(q.w()).asDiagonal();
  const Eigen::Matrix3d vector = Skew(q.vec());

  RelativePoseDerivatives result;
  result.error.head<3>() = 2.0 * q.vec();
  result.error.tail<3>() = R_j_i * (t - T_i_j.translation());
  // A step of j multiplies q by (1, ω/2) on the right, one of i by (1, −ω/2) turned by R_j_i on the
  // left.
  result.by_i.topLeftCorner<3, 3>().noalias() = (vector - scalar) * R_j_i;
  result.by_i.topRightCorner<3, 3>().setZero();
  result.by_i.bottomLeftCorner<3, 3>().noalias() = R_j_i * Skew(t);
  result.by_i.bottomRightCorner<3, 3>() = -R_j_i;
  result.by_j.topLeftCorner<3, 3>() = scalar + vector;
  result.by_j.topRightCorner<3, 3>().setZero();
  result.by_j.bottomLeftCorner<3, 3>().setZero();
  result.by_j.bottomRightCorner<3, 3>() = R;
  return result;
}

RelativePoseCost::RelativePoseCost(const Pose& T_i_j,
                                   const Matrix6d& information,
                                   const double* weight)
    : T_i_j_(T_i_j), root_(InformationRoot(information)), weight_(weight) {}

bool RelativePoseCost::Evaluate(double const* const* blocks,
                                double* residuals,
                                double** jacobians) const {
  const Pose T_i = PoseOf(blocks[0]);
  const Pose T_j = PoseOf(blocks[1]);
  const Matrix6d root = std::sqrt(*weight_) * root_;
  Eigen::Map<Vector6d> weighted(residuals);
  if (jacobians == nullptr) {
    weighted = root * RelativePoseError(T_i, T_j, T_i_j_);
    return weighted.allFinite();
  }
  const RelativePoseDerivatives d = DifferentiateRelativePose(T_i, T_j, T_i_j_);
  weighted = root * d.error;
  if (jacobians[0] != nullptr) WritePoseJacobian(root * d.by_i, jacobians[0]);
  if (jacobians[1] != nullptr) WritePoseJacobian(root * d.by_j, jacobians[1]);
  return weighted.allFinite();
}

}  // namespace strata
