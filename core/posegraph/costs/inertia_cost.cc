#include "core/posegraph/costs/inertia_cost.h"

#include <cmath>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/posegraph/costs/pose_block.h"

namespace strata {

InertiaCost::InertiaCost(double rotation_information, double translation_information)
    : rotation_root_(std::sqrt(rotation_information)),
      translation_root_(std::sqrt(translation_information)) {}

bool InertiaCost::Evaluate(double const* const* /*blocks*/,
                           double* residuals,
                           double** jacobians) const {
  Eigen::Map<Vector6d>(residuals).setZero();
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  Vector6d roots;
  roots << Eigen::Vector3d::Constant(rotation_root_), Eigen::Vector3d::Constant(translation_root_);
  WritePoseJacobian(Matrix6d(roots.asDiagonal()), jacobians[0]);
  return true;
}

}  // namespace strata
