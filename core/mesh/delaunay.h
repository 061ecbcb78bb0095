// The Delaunay triangulation of points in space, by qhull.
// Internal to core/mesh, not installed.
#ifndef STRATA_CORE_MESH_DELAUNAY_H_
#define STRATA_CORE_MESH_DELAUNAY_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

namespace strata {

using Tetrahedron = std::array<std::uint32_t, 4>;  // indices of points, ascending

// In order. None for fewer than five points or for all in a plane. INTERNAL where qhull gives up.
// REQUIRES: finite points.
absl::StatusOr<std::vector<Tetrahedron>> Triangulate(std::span<const Eigen::Vector3d> points);

}  // namespace strata

#endif  // STRATA_CORE_MESH_DELAUNAY_H_
