#include "core/mesh/alpha_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/common/disjoint_sets.h"
#include "core/common/status.h"
#include "core/mesh/delaunay.h"

namespace strata {
namespace {

using Eigen::Vector3d;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kJoinedShare = 0.95;
constexpr double kSpacings = 3.0;
constexpr double kMostSpacings = 6.0;

struct Ball {
  Vector3d centre;
  double squared_m2 = kNever;
};

// Through four points; through none where they are in a plane.
Ball Around(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  Eigen::Matrix3d edges;
  edges << (b - a).transpose(), (c - a).transpose(), (d - a).transpose();
  const double volume = edges.determinant();
  if (volume == 0.0) return {a, kNever};
  const Vector3d from_a =
      ((b - a).squaredNorm() * (c - a).cross(d - a) + (c - a).squaredNorm() * (d - a).cross(b - a) +
       (d - a).squaredNorm() * (b - a).cross(c - a)) /
      (2.0 * volume);
  return {a + from_a, from_a.squaredNorm()};
}

// The smallest one through three points.
Ball Around(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double twice_area_squared = normal.squaredNorm();
  if (twice_area_squared == 0.0) return {a, kNever};
  const Vector3d from_a = ((b - a).squaredNorm() * (c - a).cross(normal) +
                           (c - a).squaredNorm() * normal.cross(b - a)) /
                          (2.0 * twice_area_squared);
  return {a + from_a, from_a.squaredNorm()};
}

// A triangle of the triangulation between two tetrahedra, or one and nothing.
struct Face {
  Triangle corners;
  // Squared radii of the balls of its tetrahedra, and of the first ball that takes the triangle.
  std::array<double, 2> beside = {kNever, kNever};
  double from = kNever;
  std::uint32_t behind = 0;  // the corner that faces it in the tetrahedron with the smaller ball
};

struct Side {
  Triangle corners;
  std::uint32_t opposite;
  double squared_m2;
  friend bool operator<(const Side& a, const Side& b) {
    return std::tie(a.corners, a.squared_m2, a.opposite) <
           std::tie(b.corners, b.squared_m2, b.opposite);
  }
};

std::vector<Side> SidesOf(const std::vector<Tetrahedron>& tetrahedra,
                          std::span<const Vector3d> points) {
  std::vector<Side> sides;
  sides.reserve(4 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra) {
    const double squared_m2 =
        Around(points[t[0]], points[t[1]], points[t[2]], points[t[3]]).squared_m2;
    sides.push_back({{t[1], t[2], t[3]}, t[0], squared_m2});
    sides.push_back({{t[0], t[2], t[3]}, t[1], squared_m2});
    sides.push_back({{t[0], t[1], t[3]}, t[2], squared_m2});
    sides.push_back({{t[0], t[1], t[2]}, t[3], squared_m2});
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

// Bernardini and Bajaj 1997: a triangle is there from its own smallest ball on if that is empty,
// else from that of its first tetrahedron on.
std::vector<Face> FacesOf(const std::vector<Tetrahedron>& tetrahedra,
                          std::span<const Vector3d> points) {
  const std::vector<Side> sides = SidesOf(tetrahedra, points);
  std::vector<Face> faces;
  faces.reserve(sides.size() / 2 + 1);
  for (std::size_t i = 0; i < sides.size();) {
    Face face{.corners = sides[i].corners, .behind = sides[i].opposite};
    const Ball ball =
        Around(points[face.corners[0]], points[face.corners[1]], points[face.corners[2]]);
    bool empty = true;
    std::size_t k = 0;
    for (; i < sides.size() && sides[i].corners == face.corners; ++i) {
      if (k < 2) face.beside[k++] = sides[i].squared_m2;
      empty = empty && (points[sides[i].opposite] - ball.centre).squaredNorm() >= ball.squared_m2;
    }
    face.from = empty ? ball.squared_m2 : face.beside[0];
    faces.push_back(face);
  }
  return faces;
}

// The smallest α whose triangles join so many points.
double JoiningAlpha(const std::vector<Face>& faces, std::size_t points) {
  std::vector<std::uint32_t> order(faces.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) {
    return std::tie(faces[a].from, a) < std::tie(faces[b].from, b);
  });
  const double wanted = kJoinedShare * static_cast<double>(points);
  DisjointSets sets;
  std::vector<std::uint32_t> size(points, 1);
  for (const std::uint32_t f : order) {
    for (const std::size_t other : {faces[f].corners[1], faces[f].corners[2]}) {
      const std::size_t a = sets.Root(faces[f].corners[0]);
      const std::size_t b = sets.Root(other);
      if (!sets.Join(a, b)) continue;
      const std::uint32_t together = size[a] + size[b];
      size[sets.Root(a)] = together;
      if (together >= wanted) return faces[f].from;
    }
  }
  return faces.empty() ? 0.0 : faces[order.back()].from;
}

// Half the points have their nearest neighbour, an edge of the triangulation, nearer.
double MedianSpacing(const std::vector<Face>& faces, std::span<const Vector3d> points) {
  if (points.empty()) return 0.0;
  std::vector<double> nearest(points.size(), kNever);
  for (const Face& face : faces) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = face.corners[i];
      const std::uint32_t b = face.corners[(i + 1) % 3];
      const double distance_m = (points[a] - points[b]).norm();
      nearest[a] = std::min(nearest[a], distance_m);
      nearest[b] = std::min(nearest[b], distance_m);
    }
  }
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  return std::isfinite(*middle) ? *middle : 0.0;
}

double UsualAlpha(const std::vector<Face>& faces,
                  std::span<const Vector3d> points,
                  double spacing_m) {
  if (spacing_m == 0.0) spacing_m = MedianSpacing(faces, points);
  return std::clamp(JoiningAlpha(faces, points.size()),
                    std::pow(kSpacings * spacing_m, 2),
                    std::pow(kMostSpacings * spacing_m, 2));
}

Triangle FacingAwayFrom(const Vector3d& behind, Triangle t, std::span<const Vector3d> points) {
  const Vector3d normal = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
  if (normal.dot(behind - points[t[0]]) > 0.0) std::swap(t[1], t[2]);
  return t;
}

}  // namespace

absl::StatusOr<AlphaShape> MakeAlphaShape(std::span<const Vector3d> points,
                                          const AlphaShapeOptions& options,
                                          const Stop& stop) {
  if (points.size() > kMostAlphaPoints) {
    return absl::ResourceExhaustedError(
        absl::StrCat("alpha shape of ",
                     points.size(),
                     " points, at most ",
                     kMostAlphaPoints,
                     ": mesh a smaller region, or with larger voxels"));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) continue;
    return absl::InvalidArgumentError(absl::StrCat("alpha shape: point ", i, " is not finite"));
  }
  if (!options.towards.empty() && options.towards.size() != points.size()) {
    return absl::InvalidArgumentError(absl::StrCat("alpha shape: towards has ",
                                                   options.towards.size(),
                                                   " entries for ",
                                                   points.size(),
                                                   " points"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<Tetrahedron> tetrahedra, Triangulate(points));
  STRATA_RETURN_IF_ERROR(stop.status());
  const std::vector<Face> faces = FacesOf(tetrahedra, points);
  AlphaShape shape;
  shape.alpha_m2 = options.alpha_m2.has_value() ? *options.alpha_m2
                                                : UsualAlpha(faces, points, options.spacing_m);
  STRATA_RETURN_IF_ERROR(stop.status());
  shape.mesh.vertices.assign(points.begin(), points.end());
  for (const Face& face : faces) {
    const bool inside_both = face.beside[1] <= shape.alpha_m2;
    if (!(face.from <= shape.alpha_m2) || inside_both) continue;
    Vector3d behind = points[face.behind];
    if (face.beside[0] > shape.alpha_m2 && !options.towards.empty()) {
      behind = points[face.corners[0]];
      for (const std::uint32_t v : face.corners) behind -= options.towards[v].cast<double>();
    }
    shape.mesh.triangles.push_back(FacingAwayFrom(behind, face.corners, points));
  }
  DropUnusedVertices(shape.mesh);
  return shape;
}

}  // namespace strata
