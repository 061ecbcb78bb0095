// The polygons of planes (thesis 5.4.2), with holes, meeting where their planes meet.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_POLYGONS_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_POLYGONS_H_

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/primitives.h"
#include "core/planes/models/alpha_polygons.h"
#include "core/planes/models/plane_raster.h"
#include "core/world/plane_model.h"

namespace strata {

struct PolygonOptions {
  double epsilon_m = 0.25;
  double min_area_m2 = 1.0;
};

// A plane with what was seen of it.
struct SeenPlane {
  Plane plane;
  PlaneFrame frame;
  PlaneRaster raster;
  Eigen::AlignedBox3d box;  // around its surface
};

// A stretch of a line in a plane where another plane with surface begins.
struct MeetingLine {
  Eigen::Vector2d at, along;         // in the plane's frame; |along| = 1
  std::vector<double> begins, ends;  // along the line, ascending, not touching
};

// Of plane `i` with each other that meets it at more than 15°, where the other has surface within
// ε of the line.
std::vector<MeetingLine> MeetingLines(std::span<const SeenPlane> planes,
                                      std::size_t i,
                                      double epsilon_m);

// Points of the ring within ε of a line move onto it, near two lines to where they cross.
FlatRing Snapped(const FlatRing& ring, std::span<const MeetingLine> lines, double epsilon_m);

// Fewer points, none of those left out farther than `tolerance_m` from the ring; the polygon is
// valid (no ring crosses itself or another one): where that would make it invalid, by less.
// Holes that vanish are left out.
FlatPolygon Simplified(const FlatPolygon& polygon, double tolerance_m);
bool IsValid(const FlatPolygon& polygon);

// All of it: α-shape with radius ε, snapped, simplified by ε/2, its holes told apart by the rays.
// By falling area; relative to the frame of `planes`.
std::vector<PlanePolygon> PolygonsOf(std::span<const SeenPlane> planes,
                                     std::size_t i,
                                     const PolygonOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_POLYGONS_H_
