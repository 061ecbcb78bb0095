// Voxels in boxes, and one after the other along a line (Amanatides and Woo, "A Fast Voxel
// Traversal Algorithm for Ray Tracing", 1987).
#ifndef STRATA_CORE_OCCUPANCY_VOXEL_WALK_H_
#define STRATA_CORE_OCCUPANCY_VOXEL_WALK_H_

#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/mesh/voxel_blocks.h"

namespace strata {

inline Eigen::Vector3i VoxelOf(const Eigen::Vector3d& p) { return p.array().floor().cast<int>(); }

// Voxels whose middles lie in a region.
struct VoxelBox {
  Eigen::Vector3i low, high;  // half-open

  VoxelBox(const Eigen::AlignedBox3d& region, double voxel_m)
      : low(Above(region.min() / voxel_m)), high(Above(region.max() / voxel_m)) {}
  bool Contains(const Eigen::Vector3i& at) const {
    return (at.array() >= low.array()).all() && (at.array() < high.array()).all();
  }

 private:
  // The lowest voxel whose middle is not below `p`.
  static Eigen::Vector3i Above(const Eigen::Vector3d& p) {
    return (p.array() - 0.5).ceil().max(-kMostNodes).min(kMostNodes).cast<int>();
  }
};

// Calls visit(voxel, share of the line before it) for each voxel that the line crosses, `at` first,
// until that returns false or the line ends. Lengths in voxels.
template <typename Visit>
void WalkVoxels(const Eigen::Vector3d& from,
                const Eigen::Vector3d& to,
                Eigen::Vector3i at,
                const Visit& visit) {
  const Eigen::Vector3d along = to - from;
  Eigen::Vector3i step;
  Eigen::Vector3d next, every;
  for (int i = 0; i < 3; ++i) {
    step[i] = along[i] > 0.0 ? 1 : -1;
    const double edge = at[i] + (along[i] > 0.0 ? 1 : 0);
    constexpr double kNever = std::numeric_limits<double>::infinity();
    next[i] = along[i] == 0.0 ? kNever : (edge - from[i]) / along[i];
    every[i] = along[i] == 0.0 ? kNever : 1.0 / std::abs(along[i]);
  }
  double passed = 0.0;
  while (visit(at, passed)) {
    int nearest = 0;
    if (next[1] < next[nearest]) nearest = 1;
    if (next[2] < next[nearest]) nearest = 2;
    passed = next[nearest];
    if (passed > 1.0) return;
    at[nearest] += step[nearest];
    next[nearest] += every[nearest];
  }
}

}  // namespace strata

#endif  // STRATA_CORE_OCCUPANCY_VOXEL_WALK_H_
