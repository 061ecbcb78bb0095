// Eigen's solvers of symmetric matrices, each of which takes two to six seconds to compile, are
// compiled once, in eigen_solvers.cc. Headers that are compiled beforehand (strata_large_headers)
// say so to all.
#ifndef STRATA_CORE_GEOMETRY_EIGEN_SOLVERS_H_
#define STRATA_CORE_GEOMETRY_EIGEN_SOLVERS_H_

#include <Eigen/Eigenvalues>

#define STRATA_SYMMETRIC_SOLVER(size)                                        \
  template Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, size, size>>& \
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, size, size>>::compute( \
      const Eigen::EigenBase<Eigen::Matrix<double, size, size>>&, int)

extern STRATA_SYMMETRIC_SOLVER(2);
extern STRATA_SYMMETRIC_SOLVER(3);
extern STRATA_SYMMETRIC_SOLVER(6);

#endif  // STRATA_CORE_GEOMETRY_EIGEN_SOLVERS_H_
