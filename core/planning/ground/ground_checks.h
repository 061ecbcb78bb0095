// What one robot profile makes of the surfaces of a window: where the ground of a level ends and by
// what, and how far every surface is from such a place. Everything is a pure function of the
// surfaces within the profile's reach, so two tiles agree on what they both see.
//
// A robot on a surface of height z meets in a neighbouring cell
//   ground    the surface nearest to z, within max_step of it
//   obstacle  without ground, a surface above whose underside is lower than z + height
//   drop      without ground, a surface below
//   hole      without ground, if nothing reaches down to z + max_step: no ground was observed
//   inferred  what was inferred there (core/world/things/inferred_tile.h), where that is asked for,
//             rises above max_step and begins below z + height: ground or not
// more than one of the last four at times. An underside is never ground, and no robot is on it:
// up to kUndersideRiseM above z, or up to kMaxDeckM below it, there is a deck whose top was not
// seen, a hole that hides what lies under it; so are the few cells of a deck that no beam hit
// (DeckGoesOn). A hole is tolerated if along an axis or a diagonal through it no more than max_gap
// is unobserved and it ends on both sides. Obstacles, drops (also those up to a radius behind a
// hole) and holes that are not tolerated are *edges* seen from the surface; too little clearance
// above it is an edge in its own cell, and so is what was inferred over ground. Nobody stands on
// what was inferred, and it hides no hole: it adds edges and takes none away.
//
// An edge concerns a robot of level z if the surface that it is seen from is nearer to z than all
// else in that surface's cell and than the obstacle's or drop's own surface, and within the robot's
// height of z. None of this depends on max_step, max_slope or max_gap, of which larger ones only
// remove edges; smaller radius and height (as long as the robot is taller than its steps and what
// it may rise over a gap) only remove edges, too. So what is ground for a profile is ground for
// every profile that can do more.
#ifndef STRATA_CORE_PLANNING_GROUND_GROUND_CHECKS_H_
#define STRATA_CORE_PLANNING_GROUND_GROUND_CHECKS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/mls/local_plane.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/world/plan.h"

namespace strata {

// An underside that is higher above a robot than what noise and slopes explain is in its way,
// whatever it climbs [m].
inline constexpr float kUndersideRiseM = 0.1F;

// A place where ground ends for robots whose level is within [z_low_m, z_high_m].
struct GroundEdge {
  std::int32_t cell = 0;
  float z_low_m = 0.0F;
  float z_high_m = 0.0F;
  Obstruction kind = Obstruction::kNone;  // how much: value, see plan.h
  bool inferred = false;
  float value = 0.0F;
  float seen_from_m = 0.0F;  // height of the surface that saw it; of several the first
};

// What a robot of some level meets in a cell; numbers of surfaces.
struct Footing {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::uint32_t ground = kNone;
  std::uint32_t above = kNone;  // lowest obstacle above the rise
  std::uint32_t below = kNone;  // highest surface below the rise
  // Of what was inferred, the lowest that rises above the rise.
  std::uint32_t inferred = kNone;
  bool open = true;  // nothing reaches down to where ground should be
  bool IsFree() const {
    return ground == kNone && above == kNone && below == kNone && inferred == kNone;
  }
};

class GroundChecks {
 public:
  static constexpr std::uint32_t kNoSurface = 0xFFFFFFFFU;

  // Which edges are looked for: all, or those within reach of surfaces that are OnGround().
  enum class Edges : std::uint8_t { kAll, kOfGround };

  // Keeps references. REQUIRES: window.margin() ≥ checks.margin.
  GroundChecks(const GroundWindow& window,
               const ProfileChecks& checks,
               Edges edges,
               const ParallelLoop& loop = {});

  // False if an edge of the surface's own, in its cell or next to it, keeps the robot away. Of
  // surfaces at least sight_cells inside the window.
  bool OnGround(std::uint32_t i) const { return ground_[i] != Ground::kEnds; }

  // What a robot of level z meets in `cell` if it may rise or sink by `rise_m`; what hangs higher
  // than the robot is not met.
  Footing Meet(int cell, float z, float rise_m) const;
  // Footing::inferred alone.
  std::uint32_t MeetInferred(int cell, float z, float rise_m) const;

  // The surface that one move in `direction` from surface `i` leads to, over a tolerated stretch of
  // up to max_gap if the next cell is a hole; `cells` is the length of the move. kNoSurface if the
  // ground does not go on. Symmetric: the opposite move leads back.
  std::uint32_t Target(std::uint32_t i, int direction, int* cells) const;

  // Distance [m] from the centre of `cell` to the nearest edge of level z, at most reach_m.
  float EdgeDistance(int cell, float z) const;
  // The nearest edge of level z that is nearer than within_m, at most reach_m; nullptr if none.
  const GroundEdge* NearestEdge(int cell, float z, float within_m) const;
  // The nearest edge that keeps the footprint from being there; nullptr if none.
  const GroundEdge* BlockingEdge(int cell, float z) const {
    return NearestEdge(cell, z, checks_.footprint_m);
  }
  // True if the disc is clear of edges, obstacles and drops all along a move over a gap.
  bool GapIsClear(std::uint32_t from, std::uint32_t to, int direction, int cells) const;

  // Height free above the surface up to the underside of the next [m].
  float Clearance(std::uint32_t i) const;
  // Width of the hole at `cell` for level z: the shortest of its four chords, 0 beyond 64 cells.
  double HoleWidth(int cell, float z) const;

 private:
  static constexpr int kFarCells = 255;

  // Around a surface: ends next to it, goes on but not everywhere, goes on without any edge.
  enum class Ground : std::uint8_t { kEnds, kBroken, kEven };

  GroundEdge Seen(std::uint32_t i) const;
  void CollectEdges(std::uint32_t i, std::vector<GroundEdge>* edges) const;
  void CollectMet(GroundEdge seen, const Footing& footing, std::vector<GroundEdge>* edges) const;
  // `span`: number of what was inferred in the cell of `seen`, for the levels that meet it.
  void CollectInferred(GroundEdge seen, std::uint32_t span, std::vector<GroundEdge>* edges) const;
  void CollectBehind(GroundEdge seen, int direction, std::vector<GroundEdge>* edges) const;
  bool DiscIsFree(int cell, float z) const;
  bool HoleIsTolerated(int cell, float z) const;
  int HoleRun(int cell, float z, int direction, int limit) const;
  std::uint32_t OneWayTarget(std::uint32_t i, int direction, int* cells) const;
  Ground GroundAround(std::uint32_t i) const;
  void IndexEdges(const std::array<std::vector<GroundEdge>, kRowBands>& found);
  // Per cell: half the width of the smallest square of cells around it with one that is marked, at
  // most kFarCells.
  std::vector<std::uint8_t> CellsFrom(const std::vector<std::uint8_t>& marked) const;
  // The first of the disc's cells that an edge may be in, where no square of less than `cells` has
  // one.
  std::size_t FirstOfRing(int cells) const {
    return ring_first_[std::min<std::size_t>(cells, ring_first_.size() - 1)];
  }

  const GroundWindow& window_;
  const ProfileChecks& checks_;
  bool corners_count_ = false;  // an edge in a cell that touches a corner keeps the robot away
  std::vector<Ground> ground_;  // per surface
  std::vector<GroundEdge> edges_;
  std::vector<std::uint32_t> edge_first_;  // per cell
  std::vector<std::uint8_t> edge_cells_;   // CellsFrom() cells with an edge
  std::vector<std::int32_t> disc_step_;    // per disc cell
  std::vector<std::size_t> ring_first_;    // see FirstOfRing()
};

inline Footing GroundChecks::Meet(int cell, float z, float rise_m) const {
  Footing footing;
  float nearest = rise_m;
  for (std::uint32_t i = window_.begin(cell); i < window_.begin(cell + 1); ++i) {
    const WindowSurface& surface = window_.surface(i);
    const float dz = surface.z_m - z;
    if (surface.underside() && dz >= -std::max(kMaxDeckM, rise_m) && dz <= kUndersideRiseM) {
      if (footing.ground == kNoSurface) footing = Footing();
      continue;
    }
    if (surface.bottom_m - z <= rise_m) footing.open = false;
    if (dz < -rise_m) {
      footing.below = i;
    } else if (dz > 0.0F && surface.bottom_m - z >= checks_.height_m) {
      continue;
    } else if (dz <= rise_m) {
      if (footing.ground != kNoSurface && std::abs(dz) >= nearest) continue;
      nearest = std::abs(dz);
      footing.ground = i;
    } else if (footing.above == kNoSurface) {
      footing.above = i;
    }
  }
  if (footing.below != kNoSurface && footing.ground == kNoSurface &&
      window_.DeckIsUnseen(cell, z)) {
    footing.below = kNoSurface;
    footing.open = footing.above == kNoSurface;
  }
  if (window_.has_inferred()) footing.inferred = MeetInferred(cell, z, rise_m);
  return footing;
}

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_GROUND_CHECKS_H_
