#include "core/posegraph/costs/point_pairs_cost.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/costs/skew.h"

namespace strata {
namespace {

constexpr int kMeans = 6;

// Cost at the best relative pose: the means meet, the rotation is Umeyama's (7.7).
double LeastCost(const PointPairs& pairs) {
  const Eigen::Matrix<double, 3, 6> a = pairs.a.leftCols<6>();
  const Eigen::Matrix<double, 3, 6> b = pairs.b.leftCols<6>();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a * b.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d S = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) S.z() = -1.0;
  const Eigen::Matrix3d R = svd.matrixU() * S.asDiagonal() * svd.matrixV().transpose();
  return (a - R * b).squaredNorm();
}

// The differences a − T_i⁻¹ T_j b in the scan of i, one a column: a swing of both scans as one body
// leaves them as they are, unlike those in the map.
Eigen::Matrix<double, 3, 7> Differences(const PointPairs& pairs,
                                        const Pose& T_i,
                                        const Pose& T_j,
                                        const Eigen::Matrix3d& R) {
  Eigen::Matrix<double, 3, 7> e = pairs.a - R * pairs.b;
  e.col(kMeans) +=
      pairs.weight * (T_i.linear().transpose() * (T_i.translation() - T_j.translation()));
  return e;
}

}  // namespace

PointPairs SummarisePairs(const PairMoments& moments) {
  PointPairs pairs;
  const double total = moments(3, 3);
  if (!(total > 0.0)) {
    pairs.a.setZero();
    pairs.b.setZero();
    return pairs;
  }
  Vector6d sum;
  sum << moments.block<3, 1>(0, 3), moments.block<3, 1>(4, 3);
  Matrix6d scatter;
  scatter << moments.block<3, 3>(0, 0), moments.block<3, 3>(0, 4), moments.block<3, 3>(4, 0),
      moments.block<3, 3>(4, 4);
  scatter -= sum * sum.transpose() / total;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scatter);
  const Matrix6d roots =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  pairs.weight = std::sqrt(total);
  pairs.a << roots.topRows<3>(), sum.head<3>() / pairs.weight;
  pairs.b << roots.bottomRows<3>(), sum.tail<3>() / pairs.weight;
  pairs.least = LeastCost(pairs);
  return pairs;
}

double PointPairsChi2(const PointPairs& pairs, const Pose& T_i, const Pose& T_j) {
  return Differences(pairs, T_i, T_j, T_i.linear().transpose() * T_j.linear()).squaredNorm();
}

PointPairsCost::PointPairsCost(const PointPairs& pairs, double factor, const double* weight)
    : pairs_(pairs), factor_(factor), weight_(weight) {}

bool PointPairsCost::Evaluate(double const* const* blocks,
                              double* residuals,
                              double** jacobians) const {
  const Pose T_i = PoseOf(blocks[0]);
  const Pose T_j = PoseOf(blocks[1]);
  const Eigen::Matrix3d R = T_i.linear().transpose() * T_j.linear();
  const Eigen::Matrix<double, 3, 7> e = Differences(pairs_, T_i, T_j, R);
  const double root = std::sqrt(factor_ * *weight_);
  Eigen::Map<Eigen::Matrix<double, 3, 7>> weighted(residuals);
  weighted = root * e;
  if (jacobians != nullptr) {
    Eigen::Matrix<double, 21, 6> by_i;
    Eigen::Matrix<double, 21, 6> by_j;
    for (int k = 0; k <= kMeans; ++k) {
      const double s = k == kMeans ? pairs_.weight : 0.0;
      by_i.middleRows<3>(3 * k) << Skew(e.col(k) - pairs_.a.col(k)),
          s * Eigen::Matrix3d::Identity();
      by_j.middleRows<3>(3 * k) << R * Skew(pairs_.b.col(k)), -s * R;
    }
    if (jacobians[0] != nullptr) WritePoseJacobian(root * by_i, jacobians[0]);
    if (jacobians[1] != nullptr) WritePoseJacobian(root * by_j, jacobians[1]);
  }
  return weighted.allFinite();
}

}  // namespace strata
