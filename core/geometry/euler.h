// Euler angles (thesis 2.5). Of the four representations of a rotation the project computes with
// matrices and Eigen's quaternions; angle-axis is So3Exp/So3Log of pose.h, as the vector angle ·
// axis.
#ifndef STRATA_CORE_GEOMETRY_EULER_H_
#define STRATA_CORE_GEOMETRY_EULER_H_

#include <Eigen/Geometry>

namespace strata {

// R = Rz(yaw) · Ry(pitch) · Rx(roll) (eq. 2.17; φ, ϑ, ψ there). Never subtracted or averaged: use
// rotation vectors for that.
struct EulerAngles {
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;
};

Eigen::Matrix3d MatrixOf(const EulerAngles& euler);
Eigen::Quaterniond QuaternionOf(const EulerAngles& euler);

// Roll and yaw in [−π, π], pitch in [−π/2, π/2]. Where pitch is ±π/2 to 1e-9 (gimbal lock) only the
// sum or difference of roll and yaw is determined, and roll is 0. MatrixOf() of the result is R
// everywhere. REQUIRES: R is a rotation (ValidatePose).
EulerAngles EulerOf(const Eigen::Matrix3d& R);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_EULER_H_
