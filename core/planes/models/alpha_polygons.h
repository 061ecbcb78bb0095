// α-shapes of points in a plane (thesis 4.5.3, 5.4.2): regions with holes.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_ALPHA_POLYGONS_H_
#define STRATA_CORE_PLANES_MODELS_ALPHA_POLYGONS_H_

#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

using FlatRing = std::vector<Eigen::Vector2d>;  // closed, the last point joined to the first

struct FlatPolygon {
  FlatRing outer;               // counterclockwise
  std::vector<FlatRing> holes;  // clockwise
};

// Half the sum of cross products; positive for counterclockwise rings.
double SignedArea(const FlatRing& ring);
double AreaOf(const FlatPolygon& polygon);  // without the holes

// The triangles of the points' Delaunay triangulation whose circumscribed circle has at most
// `radius` (α of 4.5.3 is its square), joined over their edges. Points count in tenths of a
// millimetre, within ±100 km. By falling area. Exact predicates: Boost.Polygon's Voronoi diagram.
std::vector<FlatPolygon> AlphaPolygons(std::span<const Eigen::Vector2d> points, double radius);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_ALPHA_POLYGONS_H_
