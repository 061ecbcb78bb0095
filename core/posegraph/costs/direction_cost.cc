#include "core/posegraph/costs/direction_cost.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/skew.h"
#include "core/posegraph/costs/pose_block.h"

namespace strata {

DirectionCost::DirectionCost(const Eigen::Vector3d& normal_scan, double information)
    : normal_scan_(normal_scan), root_(std::sqrt(information)) {}

bool DirectionCost::Evaluate(double const* const* blocks,
                             double* residuals,
                             double** jacobians) const {
  const Eigen::Matrix3d R = PoseOf(blocks[0]).linear();
  const Eigen::Map<const Eigen::Vector3d> direction(blocks[1]);
  const Eigen::Vector3d normal = R * normal_scan_;
  Eigen::Map<Eigen::Vector3d> weighted(residuals);
  weighted = root_ * normal.cross(direction);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose << root_ * Skew(direction) * R * Skew(normal_scan_), Eigen::Matrix3d::Zero();
    WritePoseJacobian(by_pose, jacobians[0]);
  }
  if (jacobians != nullptr && jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> by_direction(jacobians[1]);
    by_direction = root_ * Skew(normal);
  }
  return weighted.allFinite();
}

}  // namespace strata
