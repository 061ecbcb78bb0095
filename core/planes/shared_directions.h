// Directions in which surfaces of several scans face: the main directions of a built world (thesis
// 5.3), as constraints between scans that need not see the same surface.
#ifndef STRATA_CORE_PLANES_SHARED_DIRECTIONS_H_
#define STRATA_CORE_PLANES_SHARED_DIRECTIONS_H_

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/shared_planes.h"

namespace strata {

// What is built is parallel to this, one surface and another.
inline constexpr double kParallelSigmaRad = 0.005;

struct SharedDirection {
  struct View {
    std::size_t scan = 0;                                    // index into what was given
    Eigen::Vector3d normal_scan = Eigen::Vector3d::UnitX();  // mean of its normals, either side
    double information = 0.0;                                // 1 / variance of its angle [1/rad²]
  };
  Eigen::Vector3d direction_map = Eigen::Vector3d::UnitX();
  std::vector<View> views;  // at least two, one a scan, by scan
  double area_m2 = 0.0;     // of all that faces along it
};

// Directions by falling area, each with a twentieth of all area at least: from the largest patch
// on, all that is parallel to it by 3σ of its own accuracy, of kParallelSigmaRad and of
// `options.pose_sigma_rad`, its mean, and again, until nothing changes; a patch has one direction
// at most. Patches' own accuracy is that of SharedPlaneOptions. `options` must be valid and poses
// finite. A pure function, thread-safe.
std::vector<SharedDirection> FindSharedDirections(std::span<const PosedPlanes> scans,
                                                  const SharedPlaneOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_PLANES_SHARED_DIRECTIONS_H_
