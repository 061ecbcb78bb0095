// The points themselves, joined where a ball finds none between them (thesis 4.5.3).
#ifndef STRATA_CORE_MESH_ALPHA_SHAPE_H_
#define STRATA_CORE_MESH_ALPHA_SHAPE_H_

#include <cstddef>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/mesh/triangle_mesh.h"

namespace strata {

// The Delaunay triangulation of so many takes some 25 seconds and 600 MB.
inline constexpr std::size_t kMostAlphaPoints = 200'000;

struct AlphaShape {
  TriangleMesh mesh;      // over the points, those that no triangle has left out
  double alpha_m2 = 0.0;  // the largest squared radius of a ball
};

struct AlphaShapeOptions {
  // From each point to where it was seen from; empty: not known.
  std::span<const Eigen::Vector3f> towards = {};
  std::optional<double> alpha_m2 = std::nullopt;
  // How far apart the points are, where that is known (thinned ones); 0: the median distance of
  // neighbours. Without `alpha_m2` only.
  double spacing_m = 0.0;
};

// The triangles between inside and outside, and those that have outside on either side: faces of
// the Delaunay triangulation with an empty ball through their corners of a squared radius of at
// most `alpha_m2` (the thesis' α, and CGAL's, is that square), but without those between two such
// tetrahedra. Triangles between outside and outside face to where their points were seen from.
//
// Without `alpha_m2`: the smallest that joins 95 % of the points, but at least (three times
// their spacing)², since the smallest alone leaves a sieve, and at most (six
// times)², since what stands apart need not be joined.
//
// Without triangles for fewer than five points or for all in a plane. INVALID_ARGUMENT for points
// that are not finite, or `towards` of another number; RESOURCE_EXHAUSTED for more than
// kMostAlphaPoints; the stop's status. A pure function.
absl::StatusOr<AlphaShape> MakeAlphaShape(std::span<const Eigen::Vector3d> points,
                                          const AlphaShapeOptions& options,
                                          const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_MESH_ALPHA_SHAPE_H_
