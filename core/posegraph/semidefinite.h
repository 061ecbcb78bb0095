// The check that a matrix can be an information or a moment, and the nearest one that can.
#ifndef STRATA_CORE_POSEGRAPH_SEMIDEFINITE_H_
#define STRATA_CORE_POSEGRAPH_SEMIDEFINITE_H_

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

namespace strata {

// Share of the largest entry by which a matrix may miss symmetry or a zero eigenvalue.
inline constexpr double kSemidefiniteTolerance = 1e-9;

// INVALID_ARGUMENT beginning with `field` unless all entries are finite and the matrix is symmetric
// and has no negative eigenvalue, to the tolerance.
template <int size>
absl::Status ValidateSemidefinite(const Eigen::Matrix<double, size, size>& matrix,
                                  absl::string_view field) {
  if (!matrix.allFinite()) return absl::InvalidArgumentError(absl::StrCat(field, ": not finite"));
  const double scale = matrix.cwiseAbs().maxCoeff();
  const double skew = (matrix - matrix.transpose()).cwiseAbs().maxCoeff();
  if (skew > kSemidefiniteTolerance * scale) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ": not symmetric: two entries that should be equal differ by ", skew));
  }
  if (scale == 0.0) return absl::OkStatus();
  Eigen::Matrix<double, size, size> raised = matrix / scale;
  raised.diagonal().array() += kSemidefiniteTolerance;
  if (Eigen::LLT<Eigen::Matrix<double, size, size>>(raised).info() != Eigen::Success) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ": has a negative eigenvalue; it must be positive semidefinite"));
  }
  return absl::OkStatus();
}

// Makes of `matrix` the positive semidefinite one that is nearest by Frobenius norm (Higham 1988):
// negative eigenvalues become zero. Returns the least eigenvalue that it had.
// REQUIRES: finite and symmetric.
template <int size>
double ClipToSemidefinite(Eigen::Matrix<double, size, size>& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, size, size>> solver(matrix);
  const auto& V = solver.eigenvectors();
  const Eigen::Matrix<double, size, size> clipped =
      V * solver.eigenvalues().cwiseMax(0.0).asDiagonal() * V.transpose();
  matrix = 0.5 * (clipped + clipped.transpose());
  return solver.eigenvalues().minCoeff();
}

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SEMIDEFINITE_H_
