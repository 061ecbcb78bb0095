// Points of one scan in the scan frame.
#ifndef STRATA_CORE_CLOUD_POINT_CLOUD_H_
#define STRATA_CORE_CLOUD_POINT_CLOUD_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

namespace strata {

// 8 bits a channel, as sensors and files give it.
struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Colour&, const Colour&) = default;
};
// As 0xRRGGBB, and back.
inline std::uint32_t PackedRgb(const Colour& colour) {
  return std::uint32_t{colour.r} << 16 | std::uint32_t{colour.g} << 8 | colour.b;
}
inline Colour ColourOfRgb(std::uint32_t rgb) {
  return {static_cast<std::uint8_t>(rgb >> 16),
          static_cast<std::uint8_t>(rgb >> 8),
          static_cast<std::uint8_t>(rgb)};
}

// Structure of arrays. `points` are float metres relative to `origin`, so that coordinates far from
// zero (UTM) lose nothing; whoever uploads folds `origin` into the pose. The optional columns are
// empty or as long as `points`.
//
// An organised cloud keeps its grid: points.size() == rows * columns, row by row, and a pixel
// without a return holds NaN in all three coordinates. An unorganised cloud has rows == columns ==
// 0 and only finite points.
struct PointCloud {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  // Where the sensor stood, relative to `origin`; ranges are measured from here.
  Eigen::Vector3f sensor_origin = Eigen::Vector3f::Zero();
  std::vector<Eigen::Vector3f> points;
  std::vector<float> intensity;  // sensor's own scale
  std::vector<Colour> colour;
  std::vector<std::uint16_t> label;  // class id of the map; 0 = unlabelled
  // When each was measured, by the sensor's clock and in its unit (Deskew tells which); never
  // stored.
  std::vector<double> time;
  std::uint32_t rows = 0;
  std::uint32_t columns = 0;

  std::size_t size() const { return points.size(); }
  bool organised() const { return rows != 0; }
};

// INVALID_ARGUMENT, naming the column, unless each is empty or as long as the points.
absl::Status CheckColumns(const PointCloud& cloud);

// INVALID_ARGUMENT if a column's length or the grid does not fit, or a point is infinite or beyond
// 1e6 m of the origin (NaN is accepted in organised clouds only); names the first offending point.
absl::Status ValidateCloud(const PointCloud& cloud);

// Number of points with three finite coordinates.
std::size_t CountFinite(const PointCloud& cloud);

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_POINT_CLOUD_H_
