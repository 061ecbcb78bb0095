// A pose as the solver holds it, and how costs say what moves it.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_POSE_BLOCK_H_
#define STRATA_CORE_POSEGRAPH_COSTS_POSE_BLOCK_H_

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata {

// Quaternion (x, y, z, w), then translation.
using PoseBlock = std::array<double, 7>;

inline PoseBlock PoseBlockOf(const Pose& T) {
  const Eigen::Quaterniond q(T.linear());
  const Eigen::Vector3d t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

inline Pose PoseOf(const double* block) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::Map<const Eigen::Quaterniond>(block).toRotationMatrix();
  T.translation() = Eigen::Map<const Eigen::Vector3d>(block + 4);
  return T;
}

// Writes a Jacobian for Ceres. Ours are by the six numbers of a right-hand step; those by the seven
// of the block, times PoseManifold's PlusJacobian(), which is (I; 0), have to be the same: the
// seventh column counts nothing.
template <typename Derived>
void WritePoseJacobian(const Eigen::MatrixBase<Derived>& by_step, double* jacobian) {
  constexpr int kRows = Derived::RowsAtCompileTime;
  Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>> by_block(jacobian);
  by_block.template leftCols<6>() = by_step;
  by_block.col(6).setZero();
}

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_POSE_BLOCK_H_
