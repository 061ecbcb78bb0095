#include "core/posegraph/information.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace strata {
namespace {

// diag(½, ½, ½, 1, 1, 1) P: from [translation, vec q] to [rotation, translation].
Matrix6d FromG2oErrors() {
  Matrix6d A = Matrix6d::Zero();
  A.topRightCorner<3, 3>() = 0.5 * Eigen::Matrix3d::Identity();
  A.bottomLeftCorner<3, 3>().setIdentity();
  return A;
}

}  // namespace

Matrix6d IsotropicInformation(double sigma_rad, double sigma_m) {
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad)),
      Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m));
  return information.asDiagonal();
}

Matrix6d LoosenedInformation(const Matrix6d& information, const Matrix6d& extra) {
  // By the matrix inversion lemma, without inverting the first.
  const Matrix6d sum = information + extra;
  const Matrix6d loosened = extra - extra * sum.ldlt().solve(extra);
  return 0.5 * (loosened + loosened.transpose());
}

Matrix6d WhereLess(const Matrix6d& information, const Matrix6d& other, double share) {
  // information · u = λ · other · u, the u being orthonormal with respect to `other`.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> eigen(information, other);
  Matrix6d where = Matrix6d::Zero();
  for (int k = 0; k < 6 && eigen.eigenvalues()[k] < share; ++k) {
    const Vector6d u = other * eigen.eigenvectors().col(k);
    where += u * u.transpose();
  }
  return where;
}

Matrix6d InformationFromG2o(const Matrix6d& information) {
  const Matrix6d A = FromG2oErrors();
  return A * information * A.transpose();
}

Matrix6d InformationToG2o(const Matrix6d& information) {
  const Matrix6d A = FromG2oErrors().inverse();
  return A * information * A.transpose();
}

}  // namespace strata
