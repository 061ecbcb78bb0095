// The angle between a normal that a scan saw and a main direction that moves too.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_DIRECTION_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_DIRECTION_COST_H_

#include <array>

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

namespace strata {

// A unit vector of the map.
using DirectionBlock = std::array<double, 3>;

// information · sin² of the angle between a pose block's R · normal_scan and a direction block:
// parallel and opposite are the same. The vector that is squared is R · normal_scan × direction.
class DirectionCost final : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  // `normal_scan` is a unit vector.
  DirectionCost(const Eigen::Vector3d& normal_scan, double information);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const Eigen::Vector3d normal_scan_;
  const double root_;
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_DIRECTION_COST_H_
