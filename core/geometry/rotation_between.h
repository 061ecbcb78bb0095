// The rotation from one direction to another.
#ifndef STRATA_CORE_GEOMETRY_ROTATION_BETWEEN_H_
#define STRATA_CORE_GEOMETRY_ROTATION_BETWEEN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace strata {

// The shortest one that turns `from` into the direction of `to`, neither of them 0. It is Eigen's
// FromTwoVectors(), whose decomposition for opposite vectors takes six seconds to compile.
Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_ROTATION_BETWEEN_H_
