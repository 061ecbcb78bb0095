#include "core/registration/sliding.h"

#include <algorithm>
#include <cmath>

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

double FeignedHold(double squared_lean, int matches) {
  constexpr double kSigmas = 3.0;
  constexpr double kMost = 0.015;
  // Sixteen neighbours make an element, so that only every sixteenth errs by itself.
  constexpr double kAlike = 16.0;
  if (matches <= 0) return 0.0;
  const double squared_error = squared_lean / 4.0;
  return std::min(kMost, kSigmas * squared_error / std::sqrt(matches / kAlike));
}

}  // namespace strata
