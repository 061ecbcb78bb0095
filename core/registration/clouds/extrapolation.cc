#include "core/registration/clouds/extrapolation.h"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr double kCosTenDegrees = 0.984807753012208;

bool SameWay(const Vector6d& a, const Vector6d& b) {
  return a.dot(b) > kCosTenDegrees * a.norm() * b.norm();
}

// Zero of the line through (−v1, e1) and (0, e0).
std::optional<double> LineZero(double v1, double e1, double e0) {
  if (!(e1 > e0)) return std::nullopt;
  return e0 * v1 / (e1 - e0);
}

// Minimum of the parabola through (−v2, e2), (−v1, e1) and (0, e0), v2 > v1 > 0.
std::optional<double> ParabolaMinimum(double v2, double e2, double v1, double e1, double e0) {
  // e(v) = a v² + b v + e0.
  const double slope1 = (e0 - e1) / v1;
  const double slope2 = (e0 - e2) / v2;
  const double a = (slope1 - slope2) / (v2 - v1);
  const double b = slope1 + a * v1;
  if (!(a > 0.0)) return std::nullopt;
  return -b / (2.0 * a);
}

}  // namespace

StepExtrapolator::StepExtrapolator(bool quadratic, double max_factor, double radius_m)
    : quadratic_(quadratic), max_factor_(max_factor) {
  scale_.head<3>() *= std::max(radius_m, 1e-3);
}

Vector6d StepExtrapolator::Extend(const Vector6d& step, double mean_squared_error) {
  if (steps_.size() == 3) {
    steps_.erase(steps_.begin());
    errors_.erase(errors_.begin());
  }
  steps_.push_back(step.cwiseProduct(scale_));
  errors_.push_back(mean_squared_error);
  const std::size_t n = steps_.size();
  if (n < 2 || !SameWay(steps_[n - 1], steps_[n - 2])) return Vector6d::Zero();

  const double v1 = steps_[n - 1].norm();
  std::optional<double> v = LineZero(v1, errors_[n - 2], errors_[n - 1]);
  if (quadratic_ && n == 3 && SameWay(steps_[1], steps_[0])) {
    const auto minimum =
        ParabolaMinimum(v1 + steps_[1].norm(), errors_[0], v1, errors_[1], errors_[2]);
    if (minimum.has_value() && *minimum > 0.0) v = minimum;
  }
  if (!v.has_value() || !(v1 > 0.0)) return Vector6d::Zero();
  return step * (std::min(*v, max_factor_ * v1) / v1);
}

}  // namespace strata
