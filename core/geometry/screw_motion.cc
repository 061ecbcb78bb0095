#include "core/geometry/screw_motion.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/skew.h"

namespace strata {

ScrewStep ScrewMotion(const Eigen::Vector3d& rotation_rad, const Eigen::Vector3d& velocity_m) {
  const double angle = rotation_rad.norm();
  double half = 0.5;  // sin(angle / 2) / angle
  double a = 0.5;
  double b = 1.0 / 6.0;
  if (angle > 1e-4) {
    half = std::sin(0.5 * angle) / angle;
    a = (1.0 - std::cos(angle)) / (angle * angle);
    b = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  const Eigen::Vector3d across = rotation_rad.cross(velocity_m);
  ScrewStep step;
  step.way_m = velocity_m + a * across + b * rotation_rad.cross(across);
  step.turn.w() = std::cos(0.5 * angle);
  step.turn.vec() = half * rotation_rad;
  return step;
}

Vector6d TwistOf(const Pose& T) {
  const Eigen::Vector3d rotation = So3Log(T.linear());
  const Eigen::Vector3d t = T.translation();
  const double angle = rotation.norm();
  double b = 1.0 / 12.0;
  if (angle > 1e-4) {
    const double half = 0.5 * angle;
    b = (1.0 - half * std::cos(half) / std::sin(half)) / (angle * angle);
  }
  const Eigen::Vector3d across = rotation.cross(t);
  Vector6d twist;
  twist << rotation, t - 0.5 * across + b * rotation.cross(across);
  return twist;
}

Pose Interpolate(const Pose& a, const Pose& b, double share) {
  const Vector6d twist = share * TwistOf(a.inverse() * b);
  const ScrewStep step = ScrewMotion(twist.head<3>(), twist.tail<3>());
  return a * MakePose(step.turn, step.way_m);
}

Eigen::Matrix3d So3RightJacobian(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  const Eigen::Matrix3d across = Skew(rotation_vector_rad);
  double a = 0.5;
  double b = 1.0 / 6.0;
  if (angle > 1e-4) {
    a = (1.0 - std::cos(angle)) / (angle * angle);
    b = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  return Eigen::Matrix3d::Identity() - a * across + b * across * across;
}

}  // namespace strata
