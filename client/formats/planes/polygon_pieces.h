// Polygons with holes as pieces that any program can draw, and several as one.
#ifndef STRATA_CLIENT_FORMATS_PLANES_POLYGON_PIECES_H_
#define STRATA_CLIENT_FORMATS_PLANES_POLYGON_PIECES_H_

#include <array>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/world/plane_model.h"

namespace strata {

// INVALID_ARGUMENT naming the plane: a normal that is not of unit length, a ring of fewer than
// three points, a corner beyond 10,000 km or a number that is not finite.
absl::Status CheckPlaneModel(const PlaneModel& model);

// Convex, in order; the last corner stands twice where it is a triangle.
using FlatPiece = std::array<Eigen::Vector3d, 4>;

// Trapezoids, by Boost.Polygon, that cover the polygon without its holes once; counterclockwise
// when looked at against `normal`. Beside the corners of the polygon they have corners on its
// edges. Corners are right to 1e-5 m in polygons up to 10 km wide, to 1e-9 of the width beyond.
// REQUIRES: polygon and normal as CheckPlaneModel wants them.
std::vector<FlatPiece> PiecesOf(const PlanePolygon& polygon, const Eigen::Vector3d& normal);

// What any of them covers, seen from above, as rings: borders counterclockwise, holes in them
// clockwise; of it what lies `within`. As exact as PiecesOf, of all polygons together. REQUIRES: as
// PiecesOf; `within` is not empty.
std::vector<std::vector<Eigen::Vector2d>> UnionFromAbove(
    std::span<const PlanePolygon* const> polygons, const Eigen::AlignedBox2d& within);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLANES_POLYGON_PIECES_H_
