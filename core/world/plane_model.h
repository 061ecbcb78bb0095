// The flat surfaces of a map as polygons that are true to each other (thesis 5.4).
#ifndef STRATA_CORE_WORLD_PLANE_MODEL_H_
#define STRATA_CORE_WORLD_PLANE_MODEL_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/geometry/primitives.h"
#include "core/world/constraint.h"

namespace strata {

// A closed line in the plane, its last point joined to its first; at least three points, map frame.
using PlaneRing = std::vector<Eigen::Vector3d>;

struct PlaneHole {
  PlaneRing ring;  // clockwise when looked at against the normal
  // Rays passed through most of it: a window or a door. False: nothing is known about it, as where
  // furniture hid the wall.
  bool seen_open = false;

  friend bool operator==(const PlaneHole&, const PlaneHole&) = default;
};

struct PlanePolygon {
  PlaneRing outer;  // counterclockwise when looked at against the normal
  std::vector<PlaneHole> holes;
  double area_m2 = 0.0;  // without the holes

  friend bool operator==(const PlanePolygon&, const PlanePolygon&) = default;
};

inline constexpr std::uint32_t kNoDirection = 0xFFFFFFFF;

struct ModelPlane {
  std::uint64_t id = 0;  // counts from 1 by falling area
  Plane plane;           // map frame; the normal points to where it was seen from
  PlaneKind kind = PlaneKind::kWall;
  std::uint32_t direction = kNoDirection;  // index of its main direction
  double area_m2 = 0.0;  // of its polygons; without any, of the cells of surface measured in it
  std::uint64_t point_count = 0;
  double rms_m = 0.0;                  // of its points' distance to it
  double sigma_m = 0.0;                // of its offset at the middle of its points
  double sigma_rad = 0.0;              // of its normal
  std::optional<Colour> colour;        // mean, where planes were told apart by colours
  std::vector<PlanePolygon> polygons;  // by falling area
};

// Many planes are perpendicular to it.
struct MainDirection {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit, its largest component positive
  std::uint32_t planes = 0;                              // that have it
  double sigma_rad = 0.0;                                // of their normals about it
};

// How a map's plane model came about.
struct PlaneModelInfo {
  std::uint64_t job = 0;    // that found it; 0: there is none
  std::uint64_t epoch = 0;  // whose poses it stands on
  absl::Time made;
  std::uint64_t scans = 0;   // looked at
  std::uint64_t points = 0;  // of theirs
  std::uint64_t planes = 0;
  std::vector<MainDirection> directions;  // by falling number of planes
};

struct PlaneModel {
  std::vector<ModelPlane> planes;         // by falling area
  std::vector<MainDirection> directions;  // by falling number of planes
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_PLANE_MODEL_H_
