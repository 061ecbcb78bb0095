#include "core/planning/explain.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_checks.h"
#include "core/planning/ground/ground_fit.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"
#include "core/planning/tile_cache.h"
#include "core/world/plan.h"

namespace strata {
namespace {

// The crest of a wall two cells thick fills so many of the 5 × 5 cells around; the border of ground
// to stand on fills 15.
constexpr int kCrestCells = 10;

// The checks of one tile, made again to ask them for reasons.
class TileReasons {
 public:
  TileReasons(SearchSpace& space, const SearchSpace::Slot& slot, const TileNeighbourhood& tiles)
      : space_(space),
        checks_(space.checks()),
        slot_(slot),
        window_(
            tiles, checks_.margin, checks_.cell_size_m, InferredAround(space.source(), slot.key)),
        ground_(window_, checks_, GroundChecks::Edges::kAll) {}

  std::uint32_t SurfaceOf(PatchId patch) const {
    const CellIndex cell = space_.CellOfPatch(patch);
    const SearchSpace::Column column = space_.FindCell(cell);
    const auto level = std::find(column.begin(), column.end(), patch) - column.begin();
    return window_.begin(window_.CellOfTile(CellInTile(cell))) + static_cast<std::uint32_t>(level);
  }

  Explanation WhyNotStand(std::uint32_t i) const {
    const WindowSurface& surface = window_.surface(i);
    const auto cell = static_cast<int>(surface.cell);
    if (surface.underside()) return {Obstruction::kUnknown, 0.0, Place(cell, surface.z_m)};
    const GroundEdge* edge = ground_.BlockingEdge(cell, surface.z_m);
    if (edge != nullptr) return OfEdge(*edge, surface.z_m);
    const GroundFit fit = FitGround(window_, i);
    if (fit.certain_slope_tan > checks_.slope_tan) {
      return {Obstruction::kSlope, fit.slope_rad, Place(cell, surface.z_m)};
    }
    if (fit.roughness_m > checks_.roughness_m) {
      return {Obstruction::kRoughness, fit.roughness_m, Place(cell, surface.z_m)};
    }
    return {Obstruction::kNone, 0.0, Place(cell, surface.z_m)};
  }

  // REQUIRES: the tile has no move from surface i in `direction`.
  Explanation WhyNoMove(std::uint32_t i, int direction) const {
    const WindowSurface& surface = window_.surface(i);
    int cells = 0;
    const std::uint32_t target = ground_.Target(i, direction, &cells);
    if (target == GroundChecks::kNoSurface) return OfEdge(EndOfMove(i, direction), surface.z_m);
    Explanation reason = WhyNotStand(target);
    if (reason.kind != Obstruction::kNone) return reason;
    for (int n = 1; n < cells; ++n) {
      const int cell = static_cast<int>(surface.cell) + n * window_.Step(direction);
      const GroundEdge* edge = ground_.BlockingEdge(cell, surface.z_m);
      if (edge != nullptr) return OfEdge(*edge, surface.z_m);
    }
    return reason;
  }

  Explanation WhyTooNear(std::uint32_t i, double within_m) const {
    const WindowSurface& surface = window_.surface(i);
    const auto cell = static_cast<int>(surface.cell);
    const GroundEdge* edge = ground_.NearestEdge(cell, surface.z_m, static_cast<float>(within_m));
    return edge == nullptr ? Explanation{Obstruction::kNone, 0.0, Place(cell, surface.z_m)}
                           : OfEdge(*edge, surface.z_m);
  }

 private:
  Eigen::Vector3d Place(int cell, double z) const {
    const int x = slot_.x0 + cell % window_.width() - window_.margin();
    const int y = slot_.y0 + cell / window_.width() - window_.margin();
    return {(x + 0.5) * checks_.cell_size_m, (y + 0.5) * checks_.cell_size_m, z};
  }

  // What a move that leads nowhere meets, also behind a hole that would be tolerated.
  GroundEdge EndOfMove(std::uint32_t i, int direction) const {
    const WindowSurface& surface = window_.surface(i);
    GroundEdge end = {.cell = static_cast<int>(surface.cell), .seen_from_m = surface.z_m};
    for (int n = 1; n <= checks_.GapCells(direction) + 1; ++n) {
      end.cell += window_.Step(direction);
      const float rise =
          n == 1 ? checks_.step_m : checks_.RiseOver(n * checks_.StepLength(direction));
      const Footing met = ground_.Meet(end.cell, surface.z_m, rise);
      if (met.above == Footing::kNone && met.inferred != Footing::kNone) {
        end.kind = Obstruction::kObstacle;
        end.inferred = true;
        end.value = window_.inferred(met.inferred).high_m - surface.z_m;
        return end;
      }
      const bool up = met.above != Footing::kNone;
      if (up || met.below != Footing::kNone) {
        const float z = window_.surface(up ? met.above : met.below).z_m;
        end.kind = up ? Obstruction::kObstacle : Obstruction::kDrop;
        end.value = std::abs(z - surface.z_m);
        return end;
      }
      if (met.ground != Footing::kNone) break;  // from there it does not lead back
    }
    end.cell = static_cast<int>(surface.cell) + window_.Step(direction);
    end.kind = Obstruction::kUnknown;
    return end;
  }

  Explanation OfEdge(const GroundEdge& edge, float z) const {
    Explanation reason = {edge.kind, edge.value, Place(edge.cell, z), edge.inferred};
    if (edge.kind == Obstruction::kUnknown) reason.value = ground_.HoleWidth(edge.cell, z);
    if (edge.kind == Obstruction::kObstacle && !edge.inferred && edge.value < checks_.height_m &&
        IsPlateau(edge.cell, edge.seen_from_m + edge.value)) {
      reason.kind = Obstruction::kStep;
    }
    return reason;
  }

  // True if ground goes on at height z around the cell, so that what stops is a step up to it.
  bool IsPlateau(int cell, float z) const {
    int ground = 0;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        const Footing footing = ground_.Meet(cell + dy * window_.width() + dx, z, checks_.step_m);
        if (footing.ground != Footing::kNone) ++ground;
      }
    }
    return ground > kCrestCells;
  }

  SearchSpace& space_;
  const ProfileChecks& checks_;
  const SearchSpace::Slot& slot_;
  const GroundWindow window_;
  const GroundChecks ground_;
};

bool Reached(SearchSpace& space, const SearchWorkspace& workspace, PatchId patch) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  const std::uint32_t place = patch - slot.base;
  return slot.tile->CanStand(place) &&
         workspace.DirectionOf(space.SlotOf(patch), *slot.tile, place) != ParkedTile::kUnreached;
}

Explanation OfClass(SearchSpace& space, PatchId patch) {
  return {Obstruction::kClass, static_cast<double>(space.ClassOf(patch)), space.Position(patch)};
}

struct RefusedMove {
  PatchId patch = kNoPatchId;
  int direction = 0;
};

// What is behind a refused move.
enum class Beyond : std::uint8_t { kGoalsGround, kUnknown, kOther };

// Looks for the other sides of the moves that a search was refused.
class Frontier {
 public:
  Frontier(SearchSpace& space, const SearchWorkspace& reached, const SearchWorkspace& from_goal)
      : space_(space), reached_(reached), from_goal_(from_goal) {}

  // All patches with a refused move, the nearest to the goal first; ties go by place, not by the
  // order in which tiles were touched.
  std::vector<PatchId> Patches(const Eigen::Vector3d& goal) const {
    std::vector<std::tuple<double, double, double, double, PatchId>> ranked;
    for (std::size_t slot = 0; slot < space_.slots().size(); ++slot) {
      const SearchSpace::Slot held = space_.At(static_cast<int>(slot));
      held.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
        const PatchId patch = held.base + place;
        if (!Reached(space_, reached_, patch) || !HasRefusedMove(patch)) return;
        const Eigen::Vector3d p = space_.Position(patch);
        ranked.emplace_back((p - goal).squaredNorm(), p.x(), p.y(), p.z(), patch);
      });
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<PatchId> patches;
    patches.reserve(ranked.size());
    for (const auto& entry : ranked) patches.push_back(std::get<4>(entry));
    return patches;
  }

  // Refused directions, that towards the goal first.
  std::vector<int> Refused(PatchId patch, const Eigen::Vector3d& goal) const {
    const Eigen::Vector2d towards = (goal - space_.Position(patch)).head<2>();
    std::vector<std::pair<double, int>> ranked;
    for (int k = 0; k < 8; ++k) {
      if (!IsRefused(patch, k)) continue;
      const Eigen::Vector2d step(kStepX[k], kStepY[k]);
      ranked.emplace_back(-towards.dot(step.normalized()), k);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<int> directions;
    directions.reserve(ranked.size());
    for (const auto& [progress, k] : ranked) directions.push_back(k);
    return directions;
  }

  Beyond Look(const RefusedMove& move) {
    const ProfileChecks& checks = space_.checks();
    CellIndex cell = space_.CellOfPatch(move.patch);
    float level = space_.Height(move.patch);
    const int limit = static_cast<int>(kLookAheadM / checks.StepLength(move.direction));
    const int unknown_limit = static_cast<int>((checks.footprint_m + checks.profile.max_gap_m) /
                                               checks.StepLength(move.direction));
    bool even = true;    // nothing but ground so far
    int unobserved = 0;  // cells since the last ground, walls included
    bool wall = false;   // among them
    bool unknown = false;
    for (int n = 1; n <= limit; ++n) {
      cell = {cell.x + kStepX[move.direction], cell.y + kStepY[move.direction]};
      const SearchSpace::Column column = space_.FindCell(cell);
      const PatchId next = Nearest(column, level);
      if (next == kNoPatchId) {
        if (!column.empty() && space_.Height(column.front()) < level) break;  // a drop
        wall = wall || !column.empty();
        even = even && column.empty();
        ++unobserved;
        unknown = unknown || (even && unobserved > unknown_limit);
        continue;
      }
      // Behind a hole that would be bridged anything counts that would count without it; slopes
      // under a wider one count as ground that was not seen; behind a wall it must be level.
      const bool bridged = unobserved <= checks.GapCells(move.direction);
      const float rise =
          wall      ? checks.step_m
          : bridged ? checks.height_m
                    : checks.RiseOver((unobserved + 1) * checks.StepLength(move.direction));
      if (unobserved > 0 && std::abs(space_.Height(next) - level) > rise) break;
      if (Reached(space_, from_goal_, next)) return Beyond::kGoalsGround;
      if (Reached(space_, reached_, next)) return Beyond::kOther;  // another way leads there
      even = even && std::abs(space_.Height(next) - level) <= checks.step_m;
      unobserved = 0;
      wall = false;
      level = space_.Height(next);
    }
    return unknown ? Beyond::kUnknown : Beyond::kOther;
  }

 private:
  // The ground refuses, or a forbidden class.
  bool IsRefused(PatchId patch, int direction) const {
    if (!space_.HasMove(patch, direction)) return true;
    if (space_.classes().plain()) return false;
    std::uint32_t cost = 0;
    int cells = 0;
    return space_.Follow(patch, direction, &cost, &cells) == kNoPatchId;
  }

  bool HasRefusedMove(PatchId patch) const {
    for (int k = 0; k < 8; ++k) {
      if (IsRefused(patch, k)) return true;
    }
    return false;
  }

  // The surface nearest to the level, if it is within the robot's height of it.
  PatchId Nearest(const SearchSpace::Column& column, float level) const {
    PatchId best = kNoPatchId;
    float best_off = space_.checks().height_m;
    for (const PatchId patch : column) {
      const float off = std::abs(space_.Height(patch) - level);
      if (off >= best_off) continue;
      best_off = off;
      best = patch;
    }
    return best;
  }

  SearchSpace& space_;
  const SearchWorkspace& reached_;
  const SearchWorkspace& from_goal_;
};

absl::StatusOr<RefusedMove> ChooseMove(SearchSpace& space,
                                       const SearchWorkspace& reached,
                                       PatchId goal,
                                       const Stop& stop) {
  SearchWorkspace from_goal(reached.budget());
  STRATA_RETURN_IF_ERROR(ReachAll(space, goal, from_goal, stop).status());
  Frontier frontier(space, reached, from_goal);
  const Eigen::Vector3d goal_position = space.Position(goal);
  RefusedMove any;
  RefusedMove unknown;
  int looks = 0;
  for (const PatchId patch : frontier.Patches(goal_position)) {
    if (++looks % 1024 == 0) STRATA_RETURN_IF_ERROR(stop.status());
    for (const int direction : frontier.Refused(patch, goal_position)) {
      const RefusedMove move = {patch, direction};
      if (any.patch == kNoPatchId) any = move;
      const Beyond beyond = frontier.Look(move);
      if (beyond == Beyond::kGoalsGround) return move;
      if (beyond == Beyond::kUnknown && unknown.patch == kNoPatchId) unknown = move;
    }
  }
  STRATA_RETURN_IF_ERROR(space.status());
  return unknown.patch != kNoPatchId ? unknown : any;
}

}  // namespace

std::string Explanation::ToString() const {
  const absl::string_view unit = kind == Obstruction::kSlope ? "rad" : "m";
  const std::string at = absl::StrFormat("at (%.2f, %.2f, %.2f)", where.x(), where.y(), where.z());
  if (kind == Obstruction::kUnknown && value == 0.0) return "unknown ground " + at;
  if (kind == Obstruction::kClass) return absl::StrFormat("forbidden class %.0f %s", value, at);
  return absl::StrFormat(
      "%s%s of %.2f %s %s", inferred ? "inferred " : "", strata::ToString(kind), value, unit, at);
}

absl::StatusOr<Explanation> WhyNotStand(SearchSpace& space, PatchId patch) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  if (slot.tile->CanStand(patch - slot.base) && space.Danger(patch) < 0.0F) {
    return OfClass(space, patch);
  }
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles, LoadAround(space.source(), slot.key));
  const TileReasons reasons(space, slot, tiles);
  return reasons.WhyNotStand(reasons.SurfaceOf(patch));
}

absl::StatusOr<Explanation> WhyNoMove(SearchSpace& space, PatchId patch, int direction) {
  if (space.HasMove(patch, direction)) {
    std::uint32_t cost = 0;
    int cells = 0;
    const PatchId target = space.FollowGround(patch, direction, &cost, &cells);
    STRATA_RETURN_IF_ERROR(space.status());
    if (target != kNoPatchId) {
      return space.Danger(target) < 0.0F ? OfClass(space, target) : Explanation{};
    }
  }
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles, LoadAround(space.source(), slot.key));
  const TileReasons reasons(space, slot, tiles);
  return reasons.WhyNoMove(reasons.SurfaceOf(patch), direction);
}

absl::StatusOr<Explanation> WhyTooNear(SearchSpace& space, PatchId patch, double within_m) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles, LoadAround(space.source(), slot.key));
  const TileReasons reasons(space, slot, tiles);
  return reasons.WhyTooNear(reasons.SurfaceOf(patch), within_m);
}

absl::StatusOr<Explanation> WhyNoFurther(SearchSpace& space,
                                         const SearchWorkspace& workspace,
                                         PatchId goal,
                                         const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const RefusedMove move, ChooseMove(space, workspace, goal, stop));
  if (move.patch == kNoPatchId) return Explanation{};
  return WhyNoMove(space, move.patch, move.direction);
}

}  // namespace strata
