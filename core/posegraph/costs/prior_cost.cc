#include "core/posegraph/costs/prior_cost.h"

#include <cmath>

#include <Eigen/Core>

#include "core/posegraph/costs/information_root.h"
#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/costs/relative_pose_cost.h"

namespace strata {

PriorCost::PriorCost(const Pose& T_map_scan, const Matrix6d& information, const double* weight)
    : T_map_scan_(T_map_scan), root_(InformationRoot(information)), weight_(weight) {}

bool PriorCost::Evaluate(double const* const* blocks, double* residuals, double** jacobians) const {
  const Pose T = PoseOf(blocks[0]);
  const Matrix6d root = std::sqrt(*weight_) * root_;
  Eigen::Map<Vector6d> weighted(residuals);
  weighted = root * RelativePoseError(Pose::Identity(), T, T_map_scan_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    const RelativePoseDerivatives d = DifferentiateRelativePose(Pose::Identity(), T, T_map_scan_);
    WritePoseJacobian(root * d.by_j, jacobians[0]);
  }
  return weighted.allFinite();
}

}  // namespace strata
