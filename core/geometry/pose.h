// Rigid poses. `T_a_b` maps coordinates in frame b into frame a: p_a = T_a_b * p_b. Metres and
// radians, right-handed, z up. The project's tangent order is [rotation, translation]: a 6-vector,
// a 6 × 6 covariance or information matrix has the rotation vector first.
#ifndef STRATA_CORE_GEOMETRY_POSE_H_
#define STRATA_CORE_GEOMETRY_POSE_H_

#include "absl/status/status.h"
#include <Eigen/Geometry>

namespace strata {

using Pose = Eigen::Isometry3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

Pose MakePose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m);

// INVALID_ARGUMENT unless every number is finite, |translation| ≤ `max_translation_m` and the
// linear part is a rotation to 1e-6.
absl::Status ValidatePose(const Pose& pose, double max_translation_m = 1e8);

// Rotation vector (angle × axis) ↔ rotation matrix.
Eigen::Matrix3d So3Exp(const Eigen::Vector3d& rotation_vector_rad);
// The result's norm is in [0, π].
Eigen::Vector3d So3Log(const Eigen::Matrix3d& R);

// Angle of the rotation in [0, π] and length of the translation.
double RotationAngleRad(const Pose& pose);

// Applies a small tangent step on the right: T * (So3Exp(step.head<3>()), step.tail<3>()).
Pose Retract(const Pose& T, const Vector6d& step);

// The rotation re-orthonormalised by a quaternion; for chains of products.
Pose Normalized(const Pose& T);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_POSE_H_
