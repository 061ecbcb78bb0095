#include "core/completion/beams_by_azimuth.h"

#include <algorithm>
#include <cmath>

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr int kSectors = 1024;
constexpr int kNoSector = -1;
constexpr double kSectorRad = 2 * M_PI / kSectors;

// Of an angle in [-2π, 2π].
int SectorOf(double azimuth_rad) {
  return (static_cast<int>(std::floor(azimuth_rad / kSectorRad)) + 2 * kSectors) % kSectors;
}

}  // namespace

PointCloud PointsOf(const PointCloud& cloud, absl::FunctionRef<bool(std::size_t)> keeps) {
  PointCloud part;
  part.origin = cloud.origin;
  part.sensor_origin = cloud.sensor_origin;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!keeps(i)) continue;
    part.points.push_back(cloud.points[i]);
    if (!cloud.label.empty()) part.label.push_back(cloud.label[i]);
  }
  return part;
}

BeamsByAzimuth::BeamsByAzimuth(const PointCloud& cloud, const Pose& T_map_scan)
    : cloud_(cloud),
      sensor_(T_map_scan * (cloud.sensor_origin.cast<double>() + cloud.origin)),
      sectors_(cloud.size(), kNoSector) {
  const Eigen::Matrix3d R_map_scan = T_map_scan.rotation();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const Vector3d beam = R_map_scan * (cloud.points[i] - cloud.sensor_origin).cast<double>();
    sectors_[i] = SectorOf(std::atan2(beam.y(), beam.x()));
  }
}

PointCloud BeamsByAzimuth::Towards(const AlignedBox3d& box, const Pose& T_map_box) const {
  const Vector3d middle = T_map_box * box.center() - sensor_;
  const double ahead_rad = std::atan2(middle.y(), middle.x());
  double right_rad = 0.0, left_rad = 0.0;
  for (int k = 0; k < 8; ++k) {
    const Vector3d corner =
        T_map_box * box.corner(static_cast<AlignedBox3d::CornerType>(k)) - sensor_;
    const double turn = std::remainder(std::atan2(corner.y(), corner.x()) - ahead_rad, 2 * M_PI);
    right_rad = std::min(right_rad, turn);
    left_rad = std::max(left_rad, turn);
  }
  // The sensor stands in it, or below or above.
  const bool all = left_rad - right_rad >= M_PI;
  // One sector more on each side, where angles are rounded.
  const int first = SectorOf(ahead_rad + right_rad) - 1;
  const int count = static_cast<int>((left_rad - right_rad) / kSectorRad) + 4;
  return PointsOf(cloud_, [&](std::size_t i) {
    if (sectors_[i] == kNoSector) return false;
    return all || (sectors_[i] - first + kSectors) % kSectors < count;
  });
}

}  // namespace strata
