#include "core/geometry/rotation_between.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace strata {

Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace strata
