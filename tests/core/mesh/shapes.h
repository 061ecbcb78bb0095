// Points and triangles of known shapes.
#ifndef STRATA_TESTS_CORE_MESH_SHAPES_H_
#define STRATA_TESTS_CORE_MESH_SHAPES_H_

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/mesh/triangle_mesh.h"

namespace strata::testing {

// Even over a sphere around `centre` (Fibonacci's lattice).
inline std::vector<Eigen::Vector3d> SpherePoints(std::size_t count,
                                                 double radius_m,
                                                 const Eigen::Vector3d& centre) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
    const double angle = static_cast<double>(i) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    points.emplace_back(centre +
                        radius_m * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z));
  }
  return points;
}

// Of those, what a sensor at `from` sees, in a frame that stands there.
inline PointCloud SphereSeenFrom(const Eigen::Vector3d& from,
                                 const std::vector<Eigen::Vector3d>& points,
                                 const Eigen::Vector3d& centre) {
  PointCloud cloud;
  for (const Eigen::Vector3d& p : points) {
    const bool seen = (p - centre).dot(from - p) > 0.0;
    if (seen) cloud.points.emplace_back((p - from).cast<float>());
  }
  return cloud;
}

inline Pose At(const Eigen::Vector3d& place) { return Pose(Eigen::Translation3d(place)); }

// Outwards.
inline TriangleMesh TetrahedronMesh() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

inline double SphereVolume(double radius_m) {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(radius_m, 3);
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_MESH_SHAPES_H_
