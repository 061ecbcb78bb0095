#include "core/registration/clouds/projection_image.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Core>

namespace strata {

ProjectionImage::ProjectionImage(const std::vector<Eigen::Vector3d>& points,
                                 const Eigen::Vector3d& sensor,
                                 double cell_rad)
    : points_(points),
      sensor_(sensor),
      columns_(static_cast<int>(std::ceil(2.0 * std::numbers::pi / cell_rad))),
      rows_(static_cast<int>(std::ceil(std::numbers::pi / cell_rad))),
      image_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Cell cell = CellOfDirection(points[i]);
    std::size_t& held = image_[At(cell.row, cell.column)];
    if (held == kNone || Range(points[i]) < Range(points[held])) held = i;
  }
}

std::size_t ProjectionImage::Find(const Eigen::Vector3d& p, double max_distance_m) const {
  const Cell cell = CellOfDirection(p);
  double best_m2 = max_distance_m * max_distance_m;
  std::size_t best = kNone;
  const auto offer = [&](int row, int column) {
    const std::size_t i = image_[At(row, (column + columns_) % columns_)];
    if (i == kNone || !((points_[i] - p).squaredNorm() < best_m2)) return;
    best_m2 = (points_[i] - p).squaredNorm();
    best = i;
  };
  offer(cell.row, cell.column);
  if (image_[At(cell.row, cell.column)] != kNone) return best;
  for (int row = std::max(cell.row - 1, 0); row <= std::min(cell.row + 1, rows_ - 1); ++row) {
    for (int column = cell.column - 1; column <= cell.column + 1; ++column) offer(row, column);
  }
  return best;
}

ProjectionImage::Cell ProjectionImage::CellOfDirection(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d d = p - sensor_;
  const double azimuth = std::atan2(d.y(), d.x()) + std::numbers::pi;
  const double polar = std::atan2(d.head<2>().norm(), d.z());
  return {std::min(static_cast<int>(polar / std::numbers::pi * rows_), rows_ - 1),
          std::min(static_cast<int>(azimuth / (2.0 * std::numbers::pi) * columns_), columns_ - 1)};
}

}  // namespace strata
