// The error of a measured relative pose (thesis 7.10–7.15 on the manifold; see pose_graph.h).
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_RELATIVE_POSE_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_RELATIVE_POSE_COST_H_

#include <ceres/sized_cost_function.h>

#include "core/geometry/pose.h"

namespace strata {

// e = [2 · vec q(Δ), translation of Δ], Δ = T_i_j⁻¹ T_i⁻¹ T_j.
Vector6d RelativePoseError(const Pose& T_i, const Pose& T_j, const Pose& T_i_j);

struct RelativePoseDerivatives {
  Vector6d error;
  Matrix6d by_i, by_j;  // by right-hand steps on T_i and T_j
};
RelativePoseDerivatives DifferentiateRelativePose(const Pose& T_i,
                                                  const Pose& T_j,
                                                  const Pose& T_i_j);

// weight · eᵀΩe of two pose blocks.
class RelativePoseCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  // `weight` is read whenever this is evaluated.
  RelativePoseCost(const Pose& T_i_j, const Matrix6d& information, const double* weight);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const Pose T_i_j_;
  const Matrix6d root_;
  const double* const weight_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_RELATIVE_POSE_COST_H_
