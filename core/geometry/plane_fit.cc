#include "core/geometry/plane_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/geometry/eigen_solvers.h"
#include "core/geometry/primitives.h"

namespace strata {
namespace {

constexpr double kDegenerateRatio = 1e-12;

absl::Status CheckPoints(std::span<const Eigen::Vector3d> points, std::span<const double> weights) {
  if (points.size() < 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("plane fit: ", points.size(), " points, at least 3 are needed"));
  }
  if (!weights.empty() && weights.size() != points.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("plane fit: ", weights.size(), " weights for ", points.size(), " points"));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("plane fit: point ", i, " is not finite"));
    }
    if (!weights.empty() && !(weights[i] >= 0.0 && std::isfinite(weights[i]))) {
      return absl::InvalidArgumentError(
          absl::StrCat("plane fit: weight ", i, " = ", weights[i], " is not finite and ≥ 0"));
    }
  }
  return absl::OkStatus();
}

Plane PlaneThrough(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  return Canonical({.normal = normal.normalized(), .distance = normal.normalized().dot(point)});
}

std::vector<Eigen::Vector3d> TwoPointsEach(std::span<const Line> lines) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(2 * lines.size());
  for (const Line& line : lines) {
    points.emplace_back(line.origin - line.direction);
    points.emplace_back(line.origin + line.direction);
  }
  return points;
}

}  // namespace

absl::StatusOr<PointsPlaneFit> FitPlaneToPoints(std::span<const Eigen::Vector3d> points,
                                                std::span<const double> weights) {
  STRATA_RETURN_IF_ERROR(CheckPoints(points, weights));
  const auto weight = [weights](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double sum_w = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum_w += weight(i);
    sum += weight(i) * (points[i] - points[0]);
  }
  if (!(sum_w > 0.0)) return absl::InvalidArgumentError("plane fit: all weights are 0");

  PointsPlaneFit fit;
  fit.mean = points[0] + sum / sum_w;
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = points[i] - fit.mean;
    C += weight(i) / sum_w * p * p.transpose();
  }
  if (!C.allFinite()) return absl::InvalidArgumentError("plane fit: points too far apart");
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(C);
  fit.eigenvalues = solver.eigenvalues().cwiseMax(0.0);
  if (fit.eigenvalues(1) <= kDegenerateRatio * fit.eigenvalues(2)) {
    return absl::InvalidArgumentError(
        absl::StrCat("plane fit: ", points.size(), " points lie on one line"));
  }
  fit.plane = PlaneThrough(fit.mean, solver.eigenvectors().col(0));
  fit.mean_squared_residual_m2 = fit.eigenvalues(0);
  return fit;
}

absl::StatusOr<LinesPlaneFit> FitPlaneToLines(std::span<const Line> lines,
                                              std::span<const Eigen::Vector3d> points,
                                              double min_direction_ratio) {
  if (lines.size() < 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("plane fit: ", lines.size(), " lines, at least 2 are needed"));
  }
  // MᵀM of 2.25 has the right singular vectors of M, and 2.32's sums come along.
  Eigen::Matrix3d MtM = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  const Eigen::Vector3d reference = lines.front().origin;
  for (const Line& line : lines) {
    const Eigen::Matrix3d outer = line.direction * line.direction.transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - outer;
    MtM += outer;
    A += across;
    b += across * (line.origin - reference);
  }
  if (!MtM.allFinite() || !b.allFinite()) {
    return absl::InvalidArgumentError("plane fit: a line is not finite");
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(MtM);
  LinesPlaneFit fit;
  fit.singular_values = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
  if (fit.singular_values(1) < min_direction_ratio * fit.singular_values(0)) {
    const std::vector<Eigen::Vector3d> own =
        points.empty() ? TwoPointsEach(lines) : std::vector<Eigen::Vector3d>();
    STRATA_ASSIGN_OR_RETURN(const PointsPlaneFit by_points,
                            FitPlaneToPoints(points.empty() ? own : points));
    fit.plane = by_points.plane;
    fit.point = by_points.mean;
    fit.from_points = true;
    return fit;
  }
  fit.point = reference + A.ldlt().solve(b);
  fit.plane = PlaneThrough(fit.point, solver.eigenvectors().col(0));
  return fit;
}

}  // namespace strata
