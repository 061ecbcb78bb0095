// The things in a map: what points of one class that lie together are (thesis 11.2).
#ifndef STRATA_CORE_WORLD_THINGS_ENTITY_H_
#define STRATA_CORE_WORLD_THINGS_ENTITY_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata {

// A box that stands upright: turned about z only. Map frame [m].
struct UprightBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  // length ≥ width, and height
  double yaw_rad = 0.0;                            // of its length from x to y; in [0, π)

  friend bool operator==(const UprightBox&, const UprightBox&) = default;
};

// The corners of its base, counterclockwise.
std::vector<Eigen::Vector3d> BaseOf(const UprightBox& box);
// What of the map is around it.
Eigen::AlignedBox3d BoundsOf(const UprightBox& box);

struct EntityScan {
  ScanId scan;
  std::uint64_t points = 0;  // that it saw of the entity

  friend bool operator==(const EntityScan&, const EntityScan&) = default;
};

// Which kind of thing an entity is, and how that stands in the map.
struct EntityKind {
  std::uint64_t id = 0;
  std::string name;  // empty: nobody has named it
  Pose T_map_kind = Pose::Identity();
  double residual_m = 0.0;  // of the entity's points that lie on the kind's
  double overlap = 0.0;     // their share of the entity's points, in [0, 1]
};

// A car, a window, a bench.
struct Entity {
  std::uint64_t id = 0;  // counts from 1: by class, then by falling number of points
  std::uint16_t class_id = 0;
  UprightBox box;
  double radius_m = 0.0;           // largest distance of a point from the middle of its points
  std::uint64_t points = 0;        // in all scans there are
  std::vector<EntityScan> scans;   // by commit order
  std::optional<EntityKind> kind;  // none: it is like no other, or there was too little of it
};

// How near points of a class are one thing.
struct ClassReach {
  std::uint16_t class_id = 0;
  double distance_m = 0.0;

  friend bool operator==(const ClassReach&, const ClassReach&) = default;
};

// How a map's entities came about.
struct EntitiesInfo {
  std::uint64_t job = 0;    // that found them
  std::uint64_t epoch = 0;  // whose poses they stand on
  absl::Time made;
  std::uint64_t scans = 0;          // looked at
  std::uint64_t points = 0;         // of theirs, with a class
  std::uint64_t entities = 0;       // found; fewer are left where scans were deleted
  std::vector<ClassReach> reaches;  // of every class there are points of, by id
};

// Which entities are wanted.
struct EntityQuery {
  std::optional<Eigen::AlignedBox3d> region = std::nullopt;  // their boxes reach into it
  std::uint16_t class_id = 0;                                // 0: of every class
  std::string kind = {};  // name of one, or digits of its id (KindCalled); empty: of any or none

  // Whether it takes the entity, whatever its kind.
  bool Takes(const Entity& entity) const;
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_THINGS_ENTITY_H_
