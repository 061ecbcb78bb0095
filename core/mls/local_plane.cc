#include "core/mls/local_plane.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Core>

#include "core/mls/surface_tile.h"

namespace strata {
namespace {

constexpr double kFloorPerCell = 1.0 / 20.0;
constexpr int kMinSamples = 4;
constexpr double kMinSpreadCells2 = 0.1;

}  // namespace

HeightSample SampleOf(const Surface& surface, double cell_size_m) {
  const double variance = double{surface.sigma_m} * surface.sigma_m;
  const double floor = cell_size_m * kFloorPerCell;
  return {
      .z_m = surface.z_m,
      .bottom_m = surface.bottom_m(),
      .variance_m2 = static_cast<float>(variance),
      .weight = surface.underside() ? 0.0F : static_cast<float>(1.0 / (variance + floor * floor))};
}

double LocalPlane::slope_rad() const { return std::atan(gradient.norm()); }

Eigen::Vector3d LocalPlane::Normal() const {
  return Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
}

double LocalPlane::roughness_m() const {
  const double q = 1.0 + kNoiseGate * std::sqrt(2.0 / (count - 3));
  return std::sqrt(std::max(0.0, residual_m * residual_m - q * noise_m * noise_m));
}

bool LocalPlane::SteeperThan(double tan_limit) const {
  return gradient.norm() - kNoiseGate * gradient_sigma > tan_limit;
}

std::optional<LocalPlane> LocalPlaneFit::Solve() const {
  if (count_ < kMinSamples) return std::nullopt;
  // Centred second moments, places in cells.
  const double xx = wxx_ - wx_ * wx_ / w_;
  const double xy = wxy_ - wx_ * wy_ / w_;
  const double yy = wyy_ - wy_ * wy_ / w_;
  const double xz = wxz_ - wx_ * wz_ / w_;
  const double yz = wyz_ - wy_ * wz_ / w_;
  const double zz = wzz_ - wz_ * wz_ / w_;
  const double det = xx * yy - xy * xy;
  // det / trace is at most the smaller eigenvalue and at least half of it.
  if (det <= kMinSpreadCells2 * w_ * (xx + yy)) return std::nullopt;

  const Eigen::Vector2d g((xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det);  // a cell
  const double squared = g.squaredNorm();
  const double bend = g.x() * g.x() * yy - 2.0 * g.x() * g.y() * xy + g.y() * g.y() * xx;
  // The inverse of the moments, times the part of the weights' variance that is σ.
  const double gradient_variance =
      (squared > 0.0 ? bend / (det * squared) : (xx + yy) / det) * wv_ / count_;
  const double sum = std::max(0.0, zz - g.x() * xz - g.y() * yz);

  LocalPlane plane;
  plane.height_m = (wz_ - g.x() * wx_ - g.y() * wy_) / w_;
  plane.gradient = g / cell_size_m_;
  plane.gradient_sigma = std::sqrt(gradient_variance) / cell_size_m_;
  plane.residual_m = std::sqrt(sum / w_ * count_ / (count_ - 3));
  plane.noise_m = std::sqrt(wv_ / w_ + squared / 12.0);
  plane.count = count_;
  return plane;
}

}  // namespace strata
