#include "core/storage/records.h"

#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata {

Eigen::AlignedBox2d FootprintOf(const Eigen::AlignedBox3f& box_scan, const Pose& T_map_scan) {
  Eigen::AlignedBox2d footprint;
  if (box_scan.isEmpty()) return footprint;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p_scan =
        box_scan.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner)).cast<double>();
    footprint.extend(Eigen::Vector2d((T_map_scan * p_scan).head<2>()));
  }
  return footprint;
}

}  // namespace strata
