#include "core/registration/umeyama.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "core/geometry/pose.h"
#include "core/geometry/rotation_between.h"

namespace strata {
namespace {

// Standard deviations below this share of the largest count as none.
constexpr double kFlat = 1e-6;

Eigen::Vector3d WeightedMean(std::span<const Eigen::Vector3d> points,
                             std::span<const double> weights,
                             double total) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += (weights.empty() ? 1.0 : weights[i]) * points[i];
  }
  return sum / total;
}

PointSpread SpreadOf(const Eigen::Vector3d& deviations, double magnitude_m) {
  if (deviations[0] <= 1e-12 * std::max(magnitude_m, 1.0)) return PointSpread::kPoint;
  if (deviations[1] <= kFlat * deviations[0]) return PointSpread::kLine;
  if (deviations[2] <= kFlat * deviations[0]) return PointSpread::kPlane;
  return PointSpread::kVolume;
}

// The step that turns about an axis through `centre`: p ↦ p + ω × (p − centre).
Vector6d TurnAbout(const Eigen::Vector3d& axis, const Eigen::Vector3d& centre) {
  Vector6d step;
  step << axis, -axis.cross(centre);
  return step.normalized();
}

Eigen::Matrix3d RotationOf(const Eigen::Matrix3d& covariance_yx) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance_yx,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d S = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) S.z() = -1.0;  // eq. 7.8
  return svd.matrixU() * S.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

UmeyamaResult FitRigidTransform(std::span<const Eigen::Vector3d> x,
                                std::span<const Eigen::Vector3d> y,
                                std::span<const double> weights) {
  UmeyamaResult result;
  double total = weights.empty() ? static_cast<double>(x.size()) : 0.0;
  for (const double w : weights) total += w;
  if (!(total > 0.0)) {
    for (int i = 0; i < 6; ++i) result.degenerate_directions.emplace_back(Vector6d::Unit(i));
    return result;
  }
  const Eigen::Vector3d mean_x = WeightedMean(x, weights, total);
  const Eigen::Vector3d mean_y = WeightedMean(y, weights, total);
  Eigen::Matrix3d covariance_yx = Eigen::Matrix3d::Zero();  // eq. 7.6
  Eigen::Matrix3d covariance_xx = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d covariance_yy = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = (weights.empty() ? 1.0 : weights[i]) / total;
    const Eigen::Vector3d dx = x[i] - mean_x;
    const Eigen::Vector3d dy = y[i] - mean_y;
    covariance_yx += w * dy * dx.transpose();
    covariance_xx += w * dx * dx.transpose();
    covariance_yy += w * dy * dy.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread_x(covariance_xx);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread_y(covariance_yy);
  const auto deviations = [](const auto& eigen) -> Eigen::Vector3d {
    return eigen.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  };
  // The side that spreads less decides.
  result.spread = std::max(SpreadOf(deviations(spread_x), mean_x.norm()),
                           SpreadOf(deviations(spread_y), mean_y.norm()));

  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (result.spread == PointSpread::kLine) {
    const Eigen::Vector3d axis_x = spread_x.eigenvectors().col(2);
    Eigen::Vector3d axis_y = spread_y.eigenvectors().col(2);
    if (axis_y.dot(covariance_yx * axis_x) < 0.0) axis_y = -axis_y;
    R = RotationBetween(axis_x, axis_y).toRotationMatrix();
    result.degenerate_directions.push_back(TurnAbout(axis_x, mean_x));
  } else if (result.spread == PointSpread::kPoint) {
    for (int i = 0; i < 3; ++i) {
      result.degenerate_directions.push_back(TurnAbout(Eigen::Vector3d::Unit(i), mean_x));
    }
  } else {
    R = RotationOf(covariance_yx);
  }
  result.T_y_x.linear() = R;
  result.T_y_x.translation() = mean_y - R * mean_x;  // eq. 7.5

  double squared = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    squared += (weights.empty() ? 1.0 : weights[i]) * (y[i] - result.T_y_x * x[i]).squaredNorm();
  }
  result.rms_m = std::sqrt(squared / total);
  return result;
}

Matrix6d PointInformation(std::span<const Eigen::Vector3d> x, double sigma_m) {
  Matrix6d information = Matrix6d::Zero();
  for (const Eigen::Vector3d& p : x) {
    Eigen::Matrix<double, 3, 6> J;
    J << 0, p.z(), -p.y(), 1, 0, 0, -p.z(), 0, p.x(), 0, 1, 0, p.y(), -p.x(), 0, 0, 0, 1;
    information.noalias() += J.transpose() * J;
  }
  return information / (sigma_m * sigma_m);
}

}  // namespace strata
