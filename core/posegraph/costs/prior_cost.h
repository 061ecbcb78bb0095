// The error of a measured pose in the map. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_PRIOR_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_PRIOR_COST_H_

#include <ceres/sized_cost_function.h>

#include "core/geometry/pose.h"

namespace strata {

// weight · eᵀΩe of a pose block, e being RelativePoseError() of the map's frame and the pose.
class PriorCost final : public ceres::SizedCostFunction<6, 7> {
 public:
  // `weight` is read whenever this is evaluated.
  PriorCost(const Pose& T_map_scan, const Matrix6d& information, const double* weight);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const Pose T_map_scan_;
  const Matrix6d root_;
  const double* const weight_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_PRIOR_COST_H_
