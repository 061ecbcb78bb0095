#include "core/registration/sliding.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace strata {
namespace {

// Share of features that must hold a direction. Normals that err hold as much, up to 0.004, where a
// floor is seen from poses that disagree; recorded streets, halls and campus have more, nearly
// always above 0.01.
constexpr double kLeastHold = 0.004;

}  // namespace

NormalEquations WithoutSliding(const NormalEquations& all,
                               const Matrix6d& H_along,
                               double full,
                               double radius_m) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>() /= std::max(radius_m, 1e-3);
  const Matrix6d across = scale.asDiagonal() * (all.H - H_along) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(across);
  if (eigen.eigenvalues()[0] >= kLeastHold * full) return all;
  const Vector6d held = (eigen.eigenvalues().array() >= kLeastHold * full).cast<double>();
  const Matrix6d keep = eigen.eigenvectors() * held.asDiagonal() * eigen.eigenvectors().transpose();
  // Into scaled coordinates and back.
  const Matrix6d into = scale.cwiseInverse().asDiagonal() * keep * scale.asDiagonal();
  return {into * all.H * into.transpose(), into * all.b};
}

}  // namespace strata
