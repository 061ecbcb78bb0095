#include "core/posegraph/solver/manifolds.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/problem.h>
#include <ceres/types.h>

#include "core/geometry/screw_motion.h"
#include "core/posegraph/costs/planar_cost.h"

namespace strata {
namespace {

using ConstVector3 = Eigen::Map<const Eigen::Vector3d>;
using Vector3 = Eigen::Map<Eigen::Vector3d>;

// Two unit vectors across the normal.
Eigen::Matrix<double, 3, 2> TangentsOf(const Eigen::Vector3d& normal) {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents.col(0) = normal.unitOrthogonal();
  tangents.col(1) = normal.cross(tangents.col(0));
  return tangents;
}

}  // namespace

ceres::Problem::Options KeepingManifolds() {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

bool SteppedManifold::Minus(const double* /*y*/, const double* /*x*/, double* /*step*/) const {
  return false;
}

bool SteppedManifold::MinusJacobian(const double* /*x*/, double* /*jacobian*/) const {
  return false;
}

bool PoseManifold::Plus(const double* x, const double* step, double* moved) const {
  const Eigen::Quaterniond q = Eigen::Map<const Eigen::Quaterniond>(x);
  const Eigen::Vector3d rotation = ConstVector3(step);
  const Eigen::Vector3d velocity = ConstVector3(step + 3);
  const ScrewStep screw = ScrewMotion(rotation, velocity);
  Eigen::Map<Eigen::Quaterniond> q_moved(moved);
  q_moved = (q * screw.turn).normalized();
  Vector3 t_moved(moved + 4);
  t_moved = ConstVector3(x + 4) + q * screw.way_m;
  return q_moved.coeffs().allFinite() && t_moved.allFinite();
}

bool PoseManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool PlanarPoseManifold::Plus(const double* x, const double* step, double* moved) const {
  Vector3 pose(moved);
  pose = Moved(ConstVector3(x), ConstVector3(step));
  return pose.allFinite();
}

bool PlanarPoseManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix3d>(jacobian).setIdentity();
  return true;
}

bool PlaneManifold::Plus(const double* x, const double* step, double* moved) const {
  const Eigen::Vector3d normal = ConstVector3(x);
  Vector3 n_moved(moved);
  n_moved = (normal + TangentsOf(normal) * Eigen::Vector2d(step[0], step[1])).normalized();
  moved[3] = x[3] + step[2];
  return n_moved.allFinite() && std::isfinite(moved[3]);
}

bool PlaneManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 2>() = TangentsOf(ConstVector3(x));
  J(3, 2) = 1.0;
  return true;
}

}  // namespace strata
