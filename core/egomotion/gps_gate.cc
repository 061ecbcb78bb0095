#include "core/egomotion/gps_gate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace strata {
namespace {

// Of the way of a state without GPS.
constexpr double kDriftShare = 0.05;
// A turn that is known worse than this is not made.
constexpr double kMaxSigmaYawRad = 0.3;

// The 99 % quantile of χ² (Wilson and Hilferty 1931), to 1 % for 5 degrees of freedom and more.
double Chi2Bound(double degrees) {
  const double variance = 2.0 / (9.0 * degrees);
  return degrees * std::pow(1.0 - variance + 2.3263 * std::sqrt(variance), 3);
}

struct Means {
  Eigen::Vector3d measured_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d predicted_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance_m2 = Eigen::Vector3d::Zero();  // of one fix
};

Means MeansOf(const std::deque<RejectedFix>& fixes) {
  Means sum;
  for (const RejectedFix& fix : fixes) {
    sum.measured_m += fix.measured_m;
    sum.predicted_m += fix.predicted_m;
    sum.variance_m2 += fix.sigma_m.cwiseAbs2();
  }
  const auto count = static_cast<double>(fixes.size());
  return {sum.measured_m / count, sum.predicted_m / count, sum.variance_m2 / count};
}

// The turn about z that brings the predicted way onto the measured one, and its variance.
struct Turn {
  double yaw_rad = 0.0;
  double variance = 0.0;
};

Turn BestTurn(const std::deque<RejectedFix>& fixes, const Means& means) {
  double cross = 0.0, dot = 0.0, spread_m2 = 0.0;
  for (const RejectedFix& fix : fixes) {
    const Eigen::Vector2d q = (fix.predicted_m - means.predicted_m).head<2>();
    const Eigen::Vector2d z = (fix.measured_m - means.measured_m).head<2>();
    cross += q.x() * z.y() - q.y() * z.x();
    dot += q.dot(z);
    spread_m2 += q.squaredNorm();
  }
  const double variance_m2 = means.variance_m2.head<2>().maxCoeff();
  return {std::atan2(cross, dot), variance_m2 / std::max(spread_m2, 1e-9)};
}

double Chi2(const std::deque<RejectedFix>& fixes, const Means& means, double yaw_rad) {
  const Eigen::AngleAxisd turn(yaw_rad, Eigen::Vector3d::UnitZ());
  double chi2 = 0.0;
  for (const RejectedFix& fix : fixes) {
    const Eigen::Vector3d way = turn * (fix.predicted_m - means.predicted_m);
    const double drift_m = kDriftShare * way.norm();
    const Eigen::Vector2d off = (fix.measured_m - means.measured_m - way).head<2>();
    const Eigen::Array2d variance = fix.sigma_m.head<2>().array().square() + drift_m * drift_m;
    chi2 += (off.array().square() / variance).sum();
  }
  return chi2;
}

std::optional<Relocation> Agreement(const std::deque<RejectedFix>& fixes) {
  const Means means = MeansOf(fixes);
  const auto count = static_cast<double>(fixes.size());
  Relocation relocation;
  relocation.pivot_m = means.predicted_m;
  relocation.target_m = means.measured_m;
  relocation.target_m.z() = means.predicted_m.z();     // altitudes do not decide
  relocation.sigma_m = means.variance_m2.cwiseSqrt();  // their errors are alike: no 1/√n
  if (Chi2(fixes, means, 0.0) <= Chi2Bound(2.0 * (count - 1.0))) return relocation;
  const Turn turn = BestTurn(fixes, means);
  relocation.yaw_rad = turn.yaw_rad;
  relocation.sigma_yaw_rad = std::sqrt(turn.variance);
  if (relocation.sigma_yaw_rad > kMaxSigmaYawRad ||
      Chi2(fixes, means, turn.yaw_rad) > Chi2Bound(2.0 * (count - 1.0) - 1.0)) {
    return std::nullopt;
  }
  return relocation;
}

}  // namespace

std::optional<Relocation> GpsGate::Reject(const RejectedFix& fix) {
  rejected_.push_back(fix);
  while (fix.time_s - rejected_.front().time_s > 2.0 * kAgreeingS) rejected_.pop_front();
  if (rejected_.size() < kAgreeing || fix.time_s - rejected_.front().time_s < kAgreeingS) {
    return std::nullopt;
  }
  const std::optional<Relocation> relocation = Agreement(rejected_);
  if (relocation.has_value()) rejected_.clear();
  return relocation;
}

}  // namespace strata
