// What is known about poses beyond the poses themselves.
#ifndef STRATA_CORE_WORLD_CONSTRAINT_H_
#define STRATA_CORE_WORLD_CONSTRAINT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/world/scan.h"

namespace strata {

// Who says so.
enum class ConstraintOrigin : std::uint8_t {  // stored
  kIngest = 1,                                // registration while the scan was integrated
  kPerson = 2,                                // set by hand
  kOptimize = 3,                              // found by an optimize job: a closure or a plane
};

// A local constraint, the relative pose of two scans (thesis 7.10, `T_i_j` = P_i⁻¹ P_j), or a
// prior, the pose of one scan in the map (GPS, a landmark).
struct Constraint {
  std::uint64_t id = 0;  // unique in the map, among global planes too
  ScanId i;              // empty trajectory: the map itself, and this is a prior
  ScanId j;
  Pose T_i_j = Pose::Identity();  // of a prior: T_map_j
  // [rotation, translation], of a right-hand step on T_i_j; 1/rad², 1/m². Rows of zeros: nothing is
  // known along them, as in a prior on the position alone.
  Matrix6d information = Matrix6d::Identity();
  ConstraintOrigin origin = ConstraintOrigin::kIngest;
  bool enabled = true;
  // The graph may reject it as a whole if everything else contradicts it, as the closures of a
  // foreign front end and GPS among walls are; false: believed as far as its information says.
  bool may_be_false = false;
  std::string note;

  bool is_prior() const { return i.trajectory.empty(); }
};

// INVALID_ARGUMENT naming what is wrong: a name, a scan held against itself, a pose, an information
// matrix that is not finite, symmetric and positive semidefinite, or
// a note beyond 1000 bytes.
absl::Status ValidateConstraint(const Constraint& constraint);

// What a plane is to people.
enum class PlaneKind : std::uint8_t {  // stored
  kWall = 1,                           // upright
  kLevel = 2,                          // level: floors, decks, roofs
  kSloped = 3,                         // between the two
};

// A scan that sees a global plane.
struct PlaneSupport {
  ScanId scan;
  double weight = 0.0;  // area of its surface in the plane [m²], or length of its edges [m]
  double rms_m = 0.0;   // of its points' distances to the plane
};

// A global constraint: one plane held against many scans (thesis 7.19).
struct GlobalPlane {
  std::uint64_t id = 0;  // unique in the map, among constraints too
  Plane plane;           // map frame
  PlaneKind kind = PlaneKind::kWall;
  bool from_edges = false;  // supported by edges (5.2.3), otherwise by surfaces
  bool enabled = true;
  std::vector<PlaneSupport> supports;  // by scan
  std::string note;
};

// A scan in the pose graph of the current epoch.
struct PoseNode {
  ScanId id;
  absl::Time time;
  ScanState state = ScanState::kPending;
  Pose T_map_scan_uploaded = Pose::Identity();
  Pose T_map_scan = Pose::Identity();
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_CONSTRAINT_H_
