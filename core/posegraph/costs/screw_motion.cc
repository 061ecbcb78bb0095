#include "core/posegraph/costs/screw_motion.h"

#include <cmath>

#include <Eigen/Core>

#include "core/posegraph/costs/skew.h"

namespace strata {

Pose MovedAlongScrew(const Pose& T, const Vector6d& step) {
  const Eigen::Vector3d rotation = step.head<3>();
  const double angle = rotation.norm();
  double a = 0.5;
  double b = 1.0 / 6.0;
  if (angle > 1e-4) {
    a = (1.0 - std::cos(angle)) / (angle * angle);
    b = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  const Eigen::Matrix3d turn = Skew(rotation);
  Vector6d arrived = step;
  arrived.tail<3>() += a * turn * step.tail<3>() + b * turn * turn * step.tail<3>();
  return Normalized(Retract(T, arrived));
}

}  // namespace strata
