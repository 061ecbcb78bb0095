#include "core/registration/sliding.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace strata {

NormalEquations WithoutSliding(const NormalEquations& all,
                               const Matrix6d& H_across,
                               double least,
                               double radius_m) {
  if (least <= 0.0) return all;
  Vector6d scale = Vector6d::Ones();
  scale.head<3>() /= std::max(radius_m, 1e-3);
  const Matrix6d across = scale.asDiagonal() * H_across * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(across);
  if (eigen.eigenvalues()[0] >= least) return all;
  const Vector6d held = (eigen.eigenvalues().array() >= least).cast<double>();
  const Matrix6d keep = eigen.eigenvectors() * held.asDiagonal() * eigen.eigenvectors().transpose();
  // Into scaled coordinates and back.
  const Matrix6d into = scale.cwiseInverse().asDiagonal() * keep * scale.asDiagonal();
  return {into * all.H * into.transpose(), into * all.b};
}

}  // namespace strata
