#include "core/registration/registration_result.h"

#include <algorithm>

#include "absl/strings/string_view.h"
#include <Eigen/Eigenvalues>

namespace strata {

absl::string_view ToString(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return "converged";
    case Termination::kMaxIterations:
      return "max iterations";
    case Termination::kTooLittleOverlap:
      return "too little overlap";
    case Termination::kDegenerate:
      return "degenerate";
    case Termination::kDiverged:
      return "diverged";
  }
  return "unknown";
}

NormalStep SolveNormalEquations(const Matrix6d& H,
                                const Vector6d& b,
                                double radius_m,
                                double min_eigenvalue_ratio) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>() /= std::max(radius_m, 1e-3);
  const Matrix6d scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled);
  const double bound = std::max(eigen.eigenvalues()[5] * min_eigenvalue_ratio, 1e-300);

  NormalStep result;
  Vector6d determined = eigen.eigenvalues();
  const Vector6d scaled_b = scale.asDiagonal() * b;
  for (int i = 0; i < 6; ++i) {
    const Vector6d direction = eigen.eigenvectors().col(i);
    const Vector6d tangent = scale.asDiagonal() * direction;
    if (eigen.eigenvalues()[i] < bound) {
      result.degenerate_directions.push_back(tangent.normalized());
      determined[i] = 0.0;
    } else {
      result.step += tangent * (direction.dot(scaled_b) / eigen.eigenvalues()[i]);
    }
  }
  result.information = H;
  if (result.degenerate_directions.empty()) return result;
  const Matrix6d rest = eigen.eigenvectors() * determined.cwiseMax(0.0).asDiagonal() *
                        eigen.eigenvectors().transpose();
  const Vector6d unscale = scale.cwiseInverse();
  result.information = unscale.asDiagonal() * rest * unscale.asDiagonal();
  return result;
}

}  // namespace strata
