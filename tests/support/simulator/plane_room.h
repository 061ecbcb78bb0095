// A drawn room as a plane model, and ways to look at polygons that share nothing with the product.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_PLANE_ROOM_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_PLANE_ROOM_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "core/world/constraint.h"
#include "core/world/plane_model.h"

namespace strata::testing {

// Twice the sum of the triangles between the first point and each edge.
inline Eigen::Vector3d DoubleAreaOf(const PlaneRing& ring) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    sum += (ring[i] - ring[0]).cross(ring[i + 1] - ring[0]);
  }
  return sum;
}

inline double RingAreaOf(const PlaneRing& ring) { return DoubleAreaOf(ring).norm() / 2.0; }

inline PlaneRing Oriented(PlaneRing ring, const Eigen::Vector3d& normal, bool counterclockwise) {
  if ((DoubleAreaOf(ring).dot(normal) > 0.0) != counterclockwise) {
    std::reverse(ring.begin(), ring.end());
  }
  return ring;
}

struct DrawnHole {
  PlaneRing ring;
  bool seen_open = false;
};

// A plane with one polygon.
inline ModelPlane DrawnPlane(std::uint64_t id,
                             PlaneKind kind,
                             const Eigen::Vector3d& normal,
                             const PlaneRing& outer,
                             const std::vector<DrawnHole>& holes) {
  ModelPlane plane;
  plane.id = id;
  plane.kind = kind;
  plane.plane = {normal, normal.dot(outer.front())};
  PlanePolygon polygon;
  polygon.outer = Oriented(outer, normal, true);
  polygon.area_m2 = RingAreaOf(outer);
  for (const DrawnHole& hole : holes) {
    polygon.holes.push_back({Oriented(hole.ring, normal, false), hole.seen_open});
    polygon.area_m2 -= RingAreaOf(hole.ring);
  }
  plane.area_m2 = polygon.area_m2;
  plane.polygons.push_back(std::move(polygon));
  return plane;
}

// 4 m × 3 m × 2.5 m: a door 0.9 m wide in the outline of the wall y = 0, a window 1 m wide in y =
// 3, a cupboard 1 m wide that hides x = 4, and a shaft in the floor.
inline PlaneModel DrawnRoom() {
  using Eigen::Vector3d;
  PlaneModel model;
  model.planes = {
      DrawnPlane(1,
                 PlaneKind::kLevel,
                 -Vector3d::UnitZ(),
                 {{0, 0, 2.5}, {4, 0, 2.5}, {4, 3, 2.5}, {0, 3, 2.5}},
                 {}),
      DrawnPlane(2,
                 PlaneKind::kLevel,
                 Vector3d::UnitZ(),
                 {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}},
                 {{{{1, 1, 0}, {1.5, 1, 0}, {1.5, 1.5, 0}, {1, 1.5, 0}}, true}}),
      DrawnPlane(3,
                 PlaneKind::kWall,
                 -Vector3d::UnitY(),
                 {{0, 3, 0}, {4, 3, 0}, {4, 3, 2.5}, {0, 3, 2.5}},
                 {{{{1.5, 3, 0.9}, {2.5, 3, 0.9}, {2.5, 3, 2.1}, {1.5, 3, 2.1}}, true}}),
      DrawnPlane(4,
                 PlaneKind::kWall,
                 Vector3d::UnitY(),
                 {{0, 0, 0},
                  {1, 0, 0},
                  {1, 0, 2},
                  {1.9, 0, 2},
                  {1.9, 0, 0},
                  {4, 0, 0},
                  {4, 0, 2.5},
                  {0, 0, 2.5}},
                 {}),
      DrawnPlane(5,
                 PlaneKind::kWall,
                 Vector3d::UnitX(),
                 {{0, 0, 0}, {0, 3, 0}, {0, 3, 2.5}, {0, 0, 2.5}},
                 {}),
      DrawnPlane(6,
                 PlaneKind::kWall,
                 -Vector3d::UnitX(),
                 {{4, 0, 0}, {4, 3, 0}, {4, 3, 2.5}, {4, 0, 2.5}},
                 {{{{4, 1, 0.2}, {4, 2, 0.2}, {4, 2, 1.5}, {4, 1, 1.5}}, false}})};
  return model;
}

inline PlaneModel Moved(PlaneModel model, const Eigen::Isometry3d& T) {
  for (ModelPlane& plane : model.planes) {
    plane.plane.normal = (T.linear() * plane.plane.normal).normalized();
    for (PlanePolygon& polygon : plane.polygons) {
      for (Eigen::Vector3d& p : polygon.outer) p = T * p;
      for (PlaneHole& hole : polygon.holes) {
        for (Eigen::Vector3d& p : hole.ring) p = T * p;
      }
    }
    plane.plane.distance = plane.plane.normal.dot(plane.polygons.front().outer.front());
  }
  return model;
}

// How often a ring goes around a point of its plane: by the angle under which the edges are seen.
inline bool IsInside(const PlaneRing& ring,
                     const Eigen::Vector3d& p,
                     const Eigen::Vector3d& normal) {
  double angle = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector3d a = ring[i] - p, b = ring[(i + 1) % ring.size()] - p;
    angle += std::atan2(normal.dot(a.cross(b)), a.dot(b));
  }
  return std::abs(angle) > 3.0;
}

inline bool IsInside(const PlanePolygon& polygon,
                     const Eigen::Vector3d& p,
                     const Eigen::Vector3d& normal) {
  return IsInside(polygon.outer, p, normal) &&
         std::none_of(polygon.holes.begin(), polygon.holes.end(), [&](const PlaneHole& hole) {
           return IsInside(hole.ring, p, normal);
         });
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_PLANE_ROOM_H_
