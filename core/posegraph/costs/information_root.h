// The square root of an information matrix. Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_COSTS_INFORMATION_ROOT_H_
#define STRATA_CORE_POSEGRAPH_COSTS_INFORMATION_ROOT_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace strata {

// R with RᵀR = `information`, which is positive semidefinite.
template <int size>
Eigen::Matrix<double, size, size> InformationRoot(
    const Eigen::Matrix<double, size, size>& information) {
  using Matrix = Eigen::Matrix<double, size, size>;
  const Eigen::LDLT<Matrix> ldlt(information);
  Matrix root = ldlt.transpositionsP() * Matrix::Identity();
  root = ldlt.matrixU() * root;
  return ldlt.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal() * root;
}

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_COSTS_INFORMATION_ROOT_H_
