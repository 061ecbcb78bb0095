// A closed surface around points, at a small density of them (thesis 4.5.2).
#ifndef STRATA_CORE_MESH_DENSITY_CONTOUR_H_
#define STRATA_CORE_MESH_DENSITY_CONTOUR_H_

#include <cstddef>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/mesh/triangle_mesh.h"

namespace strata {

struct DensityContourOptions {
  double voxel_m = 0.05;                           // in [0.001, 10]
  double threshold = 0.05;                         // of the normalised density; in (0, 1)
  std::size_t max_bytes = std::size_t{640} << 20;  // of the voxels

  absl::Status Validate() const;
};

// How many points are within two voxels of each node of a grid along the points' principal axes,
// divided by what 99 % of the nodes with any stay below (the thesis: by the most, which one cluster
// of outliers sets), and marching cubes at the threshold. Without triangles where there are no
// points. The surface lies around the points, on both sides of a wall, by two voxels or so.
// INVALID_ARGUMENT for points that are not finite; RESOURCE_EXHAUSTED beyond max_bytes; the stop's
// status. A pure function.
absl::StatusOr<TriangleMesh> ContourDensity(std::span<const Eigen::Vector3d> points,
                                            const DensityContourOptions& options,
                                            const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_MESH_DENSITY_CONTOUR_H_
