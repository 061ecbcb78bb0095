// The error of a measured relative pose in the plane. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

#include "core/posegraph/planar_pose_graph.h"

namespace strata {

// In (−π, π].
double WrapAngle(double angle_rad);

Eigen::Vector3d PlanarError(const PlanarPose& i, const PlanarPose& j, const PlanarPose& T_i_j);

struct PlanarDerivatives {
  Eigen::Vector3d error;
  Eigen::Matrix3d by_i, by_j;  // by steps of Moved()
};
PlanarDerivatives DifferentiatePlanar(const PlanarPose& i,
                                      const PlanarPose& j,
                                      const PlanarPose& T_i_j);

// weight · eᵀΩe of two blocks (x, y, angle), with derivatives by steps: PlanarPoseManifold's
// PlusJacobian() is the identity.
class PlanarRelativeCost final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  // `weight` is read whenever this is evaluated.
  PlanarRelativeCost(const PlanarPose& T_i_j,
                     const Eigen::Matrix3d& information,
                     const double* weight);
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override;

 private:
  const PlanarPose T_i_j_;
  const Eigen::Matrix3d root_;
  const double* const weight_;
};

// A step (x, y, angle) in the robot's own frame, along a circle: steps that turn all poses about
// one centre turn them as one body.
PlanarPose Moved(const PlanarPose& pose, const Eigen::Vector3d& step);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_
