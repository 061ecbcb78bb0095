// Shapes of robots, arms and loads along a way (thesis 4.3).
#ifndef STRATA_CORE_WORLD_SHAPE_H_
#define STRATA_CORE_WORLD_SHAPE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/world/plan.h"

namespace strata {

inline constexpr std::size_t kMaxShapeTriangles = 200'000;
inline constexpr std::size_t kMaxShapeParts = 1'000;
// Of a question: poses, and places between them that are looked at.
inline constexpr std::size_t kMaxShapePoses = 10'000;
inline constexpr std::size_t kMaxShapeLooks = 1'000'000;
// Of an answer.
inline constexpr std::size_t kMaxShapeContacts = 1'000;

// A solid.
struct ShapePart {
  enum class Kind : std::uint8_t { kBox = 0, kCylinder = 1, kSphere = 2 };
  Kind kind = Kind::kBox;
  Pose T_shape_part = Pose::Identity();  // its middle; a cylinder stands along z
  // Edges of a box; radius, 0 and height of a cylinder; radius, 0, 0 of a sphere; in (0, 100] [m].
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();
};

// In its own frame [m]: x forward, z up, the ground that it stands on at z = 0.
struct CollisionShape {
  // A mesh, closed if what is inside of it is to count; within 100 m.
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<ShapePart> parts;
};

struct ShapeQuery {
  CollisionShape shape;
  // The way: poses T_map_shape, or places on the ground, of which PosesAlong() makes some. One of
  // the two.
  std::vector<Pose> poses;
  std::vector<Eigen::Vector3d> waypoints;
  double clearance_m = 0.0;  // to be kept from everything; in [0, 10]
  // What is no higher over the ground that the shape stands on is ground; in [0, 10].
  double ground_m = 0.15;
  bool unknown_blocks = false;  // cells below it where nothing was measured are in the way
  InferredAs inferred = InferredAs::kIgnore;
};

// Upright along the way, turned and pitched as it leads; at a bend one pose before and one after
// it, so that turning on the spot is swept, too. One place alone faces along x.
std::vector<Pose> PosesAlong(const std::vector<Eigen::Vector3d>& waypoints);

// INVALID_ARGUMENT naming what is not finite, missing, too much or out of its range.
absl::Status ValidateShapeQuery(const ShapeQuery& query);

// A stretch of the way where the shape touches something.
struct ShapeContact {
  double from_m = 0.0;  // along the way, of its origin
  double to_m = 0.0;
  Eigen::Vector3d where = Eigen::Vector3d::Zero();  // where it is deepest, in the map
  double depth_m = 0.0;                             // there; of unknown ground 0
  int class_id = 0;                                 // of the surface there; 0: none
  bool unknown = false;                             // nothing but unknown ground
  bool inferred = false;                            // nobody measured what is there
};

struct ShapeCheck {
  bool free = true;
  std::string message;                 // for people, with numbers
  double free_m = 0.0;                 // along the way, up to the first contact
  double length_m = 0.0;               // of the way
  std::vector<ShapeContact> contacts;  // in order along the way
  std::uint64_t looks = 0;             // poses looked at
  double elapsed_ms = 0.0;
  std::uint64_t epoch = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_SHAPE_H_
