// The cross product as a matrix.
#ifndef STRATA_CORE_GEOMETRY_SKEW_H_
#define STRATA_CORE_GEOMETRY_SKEW_H_

#include <Eigen/Core>

namespace strata {

// [v]ₓ: Skew(v) * x = v × x.
inline Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_SKEW_H_
