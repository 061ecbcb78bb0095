// Motions along a screw: the exponential of SE(3) and what goes with it. Twists are [rotation
// vector, velocity] of the moving frame, radians and metres.
#ifndef STRATA_CORE_GEOMETRY_SCREW_MOTION_H_
#define STRATA_CORE_GEOMETRY_SCREW_MOTION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata {

// The step of a frame that turns by `turn` and goes `way_m` in its own axes of before.
struct ScrewStep {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d way_m = Eigen::Vector3d::Zero();
};

// exp of a twist: a steady turn and a steady velocity of the moving frame for one unit of time.
ScrewStep ScrewMotion(const Eigen::Vector3d& rotation_rad, const Eigen::Vector3d& velocity_m);

// log: the twist whose ScrewMotion() is T. The rotation is in [0, π].
Vector6d TwistOf(const Pose& T);

// `share` of the way from a to b along the screw that joins them; 0 is a, 1 is b.
Pose Interpolate(const Pose& a, const Pose& b, double share);

// J with So3Exp(φ + δ) = So3Exp(φ) So3Exp(J δ) to first order (Forster et al. 2017, eq. 8).
Eigen::Matrix3d So3RightJacobian(const Eigen::Vector3d& rotation_vector_rad);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_SCREW_MOTION_H_
