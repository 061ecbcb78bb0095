// What one robot profile makes of the surfaces of a window: where the ground of a level ends and by
// what, and how far every surface is from such a place. Everything is a pure function of the
// surfaces within the profile's reach, so two tiles agree on what they both see.
//
// A robot on a surface of height z meets in a neighbouring cell
//   ground    a surface within max_step of z
//   obstacle  otherwise a surface higher than that whose underside is lower than z + height
//   drop      otherwise a surface below
//   hole      otherwise (nothing, or only what hangs higher than the robot)
// A hole is tolerated if along an axis or a diagonal through it no more than max_gap is unobserved
// and it ends on both sides. Obstacles, drops (also those behind a tolerated hole) and holes that
// are not tolerated are *edges* of the level z; a surface with too little clearance is an edge of
// its own level.
#ifndef STRATA_CORE_PLANNING_GROUND_CHECKS_H_
#define STRATA_CORE_PLANNING_GROUND_CHECKS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/planning/ground_window.h"
#include "core/planning/profile_checks.h"
#include "core/world/plan.h"

namespace strata {

// A place where ground ends for robots whose level is within [z_low_m, z_high_m].
struct GroundEdge {
  std::int32_t cell = 0;
  float z_low_m = 0.0F;
  float z_high_m = 0.0F;
  Obstruction kind = Obstruction::kNone;  // of the lowest that saw it, and how much; see plan.h
  float value = 0.0F;
};

struct Footing {
  enum class Kind : std::uint8_t { kGround, kObstacle, kDrop, kHole };
  Kind kind = Kind::kHole;
  std::uint32_t surface = 0;  // unless a hole
};

class GroundChecks {
 public:
  static constexpr std::uint32_t kNoSurface = 0xFFFFFFFFU;

  // Keeps references. REQUIRES: window.margin() ≥ checks.margin.
  GroundChecks(const GroundWindow& window, const ProfileChecks& checks);

  // What a robot of level z meets in `cell` if it may rise or sink by `rise_m`.
  Footing Meet(int cell, float z, float rise_m) const;

  // The surface that one move in `direction` from surface `i` leads to, over a tolerated stretch of
  // up to max_gap if the next cell is a hole; `cells` is the length of the move. kNoSurface if the
  // ground does not go on. Symmetric: the opposite move leads back.
  std::uint32_t Target(std::uint32_t i, int direction, int* cells) const;

  // Distance [m] from the centre of `cell` to the nearest edge of level z, at most reach_m.
  float EdgeDistance(int cell, float z) const;
  // The edge that keeps the footprint from being there; nullptr if none. Of a step just over the
  // limit the lower side feels the drop that the upper side sees; the step right behind it is
  // named.
  const GroundEdge* BlockingEdge(int cell, float z) const;
  // True if the disc is clear of edges all along a move over a gap.
  bool GapIsClear(std::uint32_t from, std::uint32_t to, int direction, int cells) const;

  // Height free above the surface up to the underside of the next [m].
  float Clearance(std::uint32_t i) const;
  // Width of the hole at `cell` for level z: the shortest of its four chords, 0 beyond 64 cells.
  double HoleWidth(int cell, float z) const;

 private:
  void CollectEdges(std::uint32_t i, std::vector<GroundEdge>* edges) const;
  void CollectHole(std::uint32_t i, int direction, std::vector<GroundEdge>* edges) const;
  bool HoleIsTolerated(int cell, float z) const;
  int HoleRun(int cell, float z, int direction, int limit) const;
  std::uint32_t OneWayTarget(std::uint32_t i, int direction, int* cells) const;
  void IndexEdges(std::vector<GroundEdge> edges);
  void MarkNearCells();

  const GroundWindow& window_;
  const ProfileChecks& checks_;
  std::vector<GroundEdge> edges_;
  std::vector<std::uint32_t> edge_first_;  // per cell
  std::vector<std::uint8_t> near_edge_;    // per cell: an edge may be within reach
  std::vector<std::int32_t> disc_step_;    // per disc cell
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_CHECKS_H_
