// What holds back a pose that its terms do not determine. Internal to core/posegraph, not
// installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_INERTIA_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_INERTIA_COST_H_

#include <ceres/sized_cost_function.h>

namespace strata {

// Costs nothing wherever the pose is, but says that moving it would: steps are shorter by what this
// is to the other terms, and end where those end. Alike along every axis, unlike the damping of
// Ceres, which lets a pose slide along those axes of its scan that its planes hold least.
class InertiaCost final : public ceres::SizedCostFunction<6, 7> {
 public:
  InertiaCost(double rotation_information, double translation_information);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const double rotation_root_, translation_root_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_INERTIA_COST_H_
