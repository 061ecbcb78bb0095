#include "core/classification/places/free_space.h"

#include <algorithm>
#include <cmath>

namespace strata {

FreeSpace::FreeSpace(const Eigen::Vector2d& min_m, double cell_m, int columns, int rows)
    : min_m_(min_m),
      cell_m_(cell_m),
      columns_(columns),
      rows_(rows),
      open_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0) {}

bool FreeSpace::IsOpen(const Eigen::Vector2d& p) const {
  return IsOpen(static_cast<int>(std::floor((p - min_m_).x() / cell_m_)),
                static_cast<int>(std::floor((p - min_m_).y() / cell_m_)));
}

double FreeSpace::Cast(const Eigen::Vector2d& from, double angle_rad, double most_m) const {
  const Eigen::Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
  double range = 0.0;
  while (range < most_m && IsOpen(from + range * along)) range += 0.5 * cell_m_;
  return std::min(range, most_m);
}

}  // namespace strata
