#include "core/classification/features/local_shape.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace strata {

LocalShape DescribeShape(const Eigen::Vector3f& centre,
                         std::span<const Eigen::Vector3f> around,
                         std::span<const std::uint32_t> indices) {
  // Relative to the centre, so that floats keep their digits.
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
  for (const std::uint32_t index : indices) {
    const Eigen::Vector3f r = around[index] - centre;
    mean += r;
    sum.noalias() += r * r.transpose();
  }
  const auto n = static_cast<float>(indices.size() + 1);
  mean /= n;
  const Eigen::Matrix3f covariance = sum / n - mean * mean.transpose();
  LocalShape shape;
  if (covariance.trace() <= 0.0F) return shape;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(covariance);
  shape.values = solver.eigenvalues().reverse().cwiseMax(0.0F);
  shape.axis = solver.eigenvectors().col(2);
  shape.normal = solver.eigenvectors().col(0);
  return shape;
}

}  // namespace strata
