// A scan as its sensor sees it: ranges on a grid of directions.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_RANGE_IMAGE_H_
#define STRATA_CORE_PLANES_RANGE_IMAGE_H_

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

struct RangeImage {
  static constexpr std::uint32_t kNothing = 0xFFFFFFFF;

  int rows = 0, columns = 0;
  bool wraps = false;                // column 0 is beside the last one
  bool empty_is_far = false;         // a pixel without a point looked past everything
  std::vector<std::uint32_t> point;  // index into the cloud or kNothing, row by row
  std::vector<float> range_m;        // of that point; infinity for kNothing

  // The pixel beside (row, column), or -1 outside.
  std::int64_t At(int row, int column) const {
    if (wraps) column = (column + columns) % columns;
    if (row < 0 || row >= rows || column < 0 || column >= columns) return -1;
    return std::int64_t{row} * columns + column;
  }
};

// The grid of an organised cloud; of any other one a spherical image whose pixels are as small as
// they can be without leaving gaps between them, each with its nearest point. No image (0 rows)
// where points are too few or too scattered to see edges in.
RangeImage MakeRangeImage(const PointCloud& cloud, double max_range_m);

// The points (indices into the cloud, ascending) at whose border, up, down or to the sides, the
// sensor saw something more than `jump_m` farther (5.2.3 step 1), and where this is no slant: the
// surface goes on on the other side with less than a third of the jump.
std::vector<std::uint32_t> DepthBorders(const RangeImage& image, double jump_m);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_RANGE_IMAGE_H_
