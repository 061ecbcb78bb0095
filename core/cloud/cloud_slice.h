// A part of a cloud.
#ifndef STRATA_CORE_CLOUD_CLOUD_SLICE_H_
#define STRATA_CORE_CLOUD_CLOUD_SLICE_H_

#include <cstddef>

#include "core/cloud/point_cloud.h"

namespace strata {

// Points [begin, end) of `cloud` with their columns; grid and origins stay behind.
// REQUIRES: begin <= end <= cloud.size(), and columns that are empty or as long as the points.
PointCloud SliceOf(const PointCloud& cloud, std::size_t begin, std::size_t end);

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_CLOUD_SLICE_H_
