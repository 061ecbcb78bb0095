// The error of a measured relative pose in the plane. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_
#define STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_

#include <Eigen/Core>

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

// A step (x, y, angle) in the robot's own frame, along a circle: steps that turn all poses about
// one centre turn them as one body.
PlanarPose Moved(const PlanarPose& pose, const Eigen::Vector3d& step);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_PLANAR_COST_H_
