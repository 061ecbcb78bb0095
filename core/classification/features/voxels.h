// Clouds thinned to one point a voxel.
// Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_VOXELS_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_VOXELS_H_

#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// The mean of the points of every voxel, voxels in the order of their place. Points must be finite
// and within 2²⁰ voxels of zero.
std::vector<Eigen::Vector3f> VoxelMeans(std::span<const Eigen::Vector3f> points, double edge_m);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_VOXELS_H_
