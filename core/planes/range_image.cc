#include "core/planes/range_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/geometry/primitives.h"

namespace strata {
namespace {

constexpr double kFinestPixelRad = 0.0035;   // 0.2°
constexpr double kCoarsestPixelRad = 0.035;  // 2°
constexpr double kGrowth = 1.4;
// Share of the pixels whose four neighbours have points too: recorded scans reach 0.4 to 0.8 with
// the coarsest pixels (borders and thinned points), and no less than half of it a little before.
constexpr double kClosed = 0.33;
constexpr float kFar = std::numeric_limits<float>::infinity();

struct Direction {
  std::uint32_t point;
  float range_m, azimuth_rad, elevation_rad;
};

RangeImage GridOf(const PointCloud& cloud, double max_range_m) {
  RangeImage image;
  image.rows = static_cast<int>(cloud.rows);
  image.columns = static_cast<int>(cloud.columns);
  image.empty_is_far = true;
  image.point.assign(cloud.size(), RangeImage::kNothing);
  image.range_m.assign(cloud.size(), kFar);
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const float range = (cloud.points[i] - cloud.sensor_origin).norm();
    if (!(range <= max_range_m)) continue;
    image.point[i] = i;
    image.range_m[i] = range;
  }
  return image;
}

std::vector<Direction> DirectionsOf(const PointCloud& cloud, double max_range_m) {
  std::vector<Direction> directions;
  directions.reserve(cloud.size());
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = (cloud.points[i] - cloud.sensor_origin).cast<double>();
    const double range = p.norm();
    if (!(range > 1e-6 && range <= max_range_m)) continue;
    const Bearing bearing = BearingOf(p / range);
    directions.push_back({i,
                          static_cast<float>(range),
                          static_cast<float>(bearing.azimuth_rad),
                          static_cast<float>(bearing.elevation_rad)});
  }
  return directions;
}

RangeImage SphericalImage(const std::vector<Direction>& directions, double pixel_rad) {
  RangeImage image;
  image.wraps = true;
  image.columns = static_cast<int>(std::ceil(2 * std::numbers::pi / pixel_rad));
  image.rows = static_cast<int>(std::ceil(std::numbers::pi / pixel_rad));
  const double column_rad = 2 * std::numbers::pi / image.columns;
  const double row_rad = std::numbers::pi / image.rows;
  const auto pixels =
      static_cast<std::size_t>(image.rows) * static_cast<std::size_t>(image.columns);
  image.point.assign(pixels, RangeImage::kNothing);
  image.range_m.assign(pixels, kFar);
  for (const Direction& d : directions) {
    const int column = std::min(static_cast<int>((d.azimuth_rad + std::numbers::pi) / column_rad),
                                image.columns - 1);
    const int row = std::min(static_cast<int>((d.elevation_rad + std::numbers::pi / 2) / row_rad),
                             image.rows - 1);
    const auto at = static_cast<std::size_t>(image.At(row, std::max(column, 0)));
    if (d.range_m >= image.range_m[at]) continue;
    image.range_m[at] = d.range_m;
    image.point[at] = d.point;
  }
  return image;
}

std::array<std::int64_t, 4> Neighbours(const RangeImage& image, std::int64_t at) {
  const int row = static_cast<int>(at / image.columns);
  const int column = static_cast<int>(at % image.columns);
  return {image.At(row - 1, column),
          image.At(row + 1, column),
          image.At(row, column - 1),
          image.At(row, column + 1)};
}

bool Occupied(const RangeImage& image, std::int64_t at) {
  return at >= 0 && image.point[static_cast<std::size_t>(at)] != RangeImage::kNothing;
}

double ClosedShare(const RangeImage& image) {
  std::size_t occupied = 0;
  std::size_t closed = 0;
  for (std::int64_t i = 0; i < std::ssize(image.point); ++i) {
    if (!Occupied(image, i)) continue;
    ++occupied;
    const std::array<std::int64_t, 4> beside = Neighbours(image, i);
    closed += std::all_of(
        beside.begin(), beside.end(), [&](std::int64_t n) { return Occupied(image, n); });
  }
  return occupied == 0 ? 0.0 : static_cast<double>(closed) / static_cast<double>(occupied);
}

bool LooksPast(const RangeImage& image,
               std::int64_t from,
               std::int64_t inner,
               std::int64_t outer,
               double jump_m) {
  if (outer < 0 || !Occupied(image, inner)) return false;
  const double range = image.range_m[static_cast<std::size_t>(from)];
  const double jump = image.range_m[static_cast<std::size_t>(outer)] - range;
  if (!Occupied(image, outer) && !image.empty_is_far) return false;
  const double slant = std::abs(range - image.range_m[static_cast<std::size_t>(inner)]);
  return jump > jump_m && 3.0 * slant < std::min(jump, 3.0 * jump_m);
}

}  // namespace

RangeImage MakeRangeImage(const PointCloud& cloud, double max_range_m) {
  if (cloud.organised()) return GridOf(cloud, max_range_m);
  const std::vector<Direction> directions = DirectionsOf(cloud, max_range_m);
  // No finer than a pixel for every point if they were all over the sphere.
  const double start =
      std::max(kFinestPixelRad,
               0.3 * std::sqrt(4 * std::numbers::pi / static_cast<double>(directions.size() + 1)));
  for (double pixel = start; pixel <= kCoarsestPixelRad; pixel *= kGrowth) {
    RangeImage image = SphericalImage(directions, pixel);
    if (ClosedShare(image) >= kClosed) return image;
  }
  return {};
}

std::vector<std::uint32_t> DepthBorders(const RangeImage& image, double jump_m) {
  std::vector<std::uint32_t> edgels;
  for (std::int64_t i = 0; i < std::ssize(image.point); ++i) {
    if (!Occupied(image, i)) continue;
    const auto [below, above, left, right] = Neighbours(image, i);
    if (LooksPast(image, i, below, above, jump_m) || LooksPast(image, i, above, below, jump_m) ||
        LooksPast(image, i, left, right, jump_m) || LooksPast(image, i, right, left, jump_m)) {
      edgels.push_back(image.point[static_cast<std::size_t>(i)]);
    }
  }
  std::sort(edgels.begin(), edgels.end());
  return edgels;
}

}  // namespace strata
