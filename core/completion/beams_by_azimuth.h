// Which beams of a scan may go through a box.
#ifndef STRATA_CORE_COMPLETION_BEAMS_BY_AZIMUTH_H_
#define STRATA_CORE_COMPLETION_BEAMS_BY_AZIMUTH_H_

#include <cstddef>
#include <vector>

#include "absl/functional/function_ref.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// Points and labels of those that `keeps` takes by their index, in their order; with the origins.
PointCloud PointsOf(const PointCloud& cloud, absl::FunctionRef<bool(std::size_t)> keeps);

// By the direction in which each goes, as seen from above: one in twenty goes towards a thing some
// metres away, and to look at a beam closely is what takes time. Reading is thread-safe.
class BeamsByAzimuth {
 public:
  // `cloud` must outlive it.
  BeamsByAzimuth(const PointCloud& cloud, const Pose& T_map_scan);

  // Finite points in their order, at least all those whose beams go through the box.
  PointCloud Towards(const Eigen::AlignedBox3d& box, const Pose& T_map_box) const;

 private:
  const PointCloud& cloud_;
  const Eigen::Vector3d sensor_;  // map frame
  std::vector<int> sectors_;      // of each point
};

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_BEAMS_BY_AZIMUTH_H_
