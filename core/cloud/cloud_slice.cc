#include "core/cloud/cloud_slice.h"

#include <cstddef>

namespace strata {

PointCloud SliceOf(const PointCloud& cloud, std::size_t begin, std::size_t end) {
  const auto slice = [=](const auto& column, auto& out) {
    if (column.empty()) return;
    out.assign(column.begin() + static_cast<std::ptrdiff_t>(begin),
               column.begin() + static_cast<std::ptrdiff_t>(end));
  };
  PointCloud part;
  slice(cloud.points, part.points);
  slice(cloud.intensity, part.intensity);
  slice(cloud.colour, part.colour);
  slice(cloud.label, part.label);
  slice(cloud.time, part.time);
  return part;
}

}  // namespace strata
