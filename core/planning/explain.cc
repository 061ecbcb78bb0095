#include "core/planning/explain.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground_checks.h"
#include "core/planning/ground_fit.h"
#include "core/planning/ground_window.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
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
  TileReasons(const SearchSpace& space,
              const SearchSpace::Slot& slot,
              const TileNeighbourhood& tiles)
      : checks_(space.checks()),
        slot_(slot),
        window_(tiles, checks_.margin, checks_.cell_size_m),
        ground_(window_, checks_) {}

  std::uint32_t SurfaceOf(PatchId patch) const {
    const std::uint32_t local = patch - slot_.base;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    slot_.tile->FindCell(slot_.tile->cell[local], &first, &count);
    return window_.begin(window_.CellOfTile(slot_.tile->cell[local])) + local - first;
  }

  Explanation WhyNotStand(std::uint32_t i) const {
    const WindowSurface& surface = window_.surface(i);
    const auto cell = static_cast<int>(surface.cell);
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
    const int next = static_cast<int>(surface.cell) + window_.Step(direction);
    int cells = 0;
    const std::uint32_t target = ground_.Target(i, direction, &cells);
    if (target == GroundChecks::kNoSurface) {
      return {
          Obstruction::kUnknown, ground_.HoleWidth(next, surface.z_m), Place(next, surface.z_m)};
    }
    Explanation reason = WhyNotStand(target);
    if (reason.kind != Obstruction::kNone) return reason;
    for (int n = 1; n < cells; ++n) {
      const int cell = static_cast<int>(surface.cell) + n * window_.Step(direction);
      const GroundEdge* edge = ground_.BlockingEdge(cell, surface.z_m);
      if (edge != nullptr) return OfEdge(*edge, surface.z_m);
    }
    return reason;
  }

 private:
  Eigen::Vector3d Place(int cell, double z) const {
    const int x = slot_.x0 + cell % window_.width() - window_.margin();
    const int y = slot_.y0 + cell / window_.width() - window_.margin();
    return {(x + 0.5) * checks_.cell_size_m, (y + 0.5) * checks_.cell_size_m, z};
  }

  Explanation OfEdge(const GroundEdge& edge, float z) const {
    Explanation reason = {edge.kind, edge.value, Place(edge.cell, z)};
    if (edge.kind == Obstruction::kUnknown) reason.value = ground_.HoleWidth(edge.cell, z);
    if (edge.kind == Obstruction::kObstacle && edge.value < checks_.height_m &&
        IsPlateau(edge.cell, edge.z_low_m + edge.value)) {
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
        if (footing.kind == Footing::Kind::kGround) ++ground;
      }
    }
    return ground > kCrestCells;
  }

  const ProfileChecks& checks_;
  const SearchSpace::Slot& slot_;
  const GroundWindow window_;
  const GroundChecks ground_;
};

bool HasRefusedMove(const PreparedTile& tile, std::uint32_t patch) {
  for (const Move& move : tile.moves[patch]) {
    if (move.cost == Move::kNone) return true;
  }
  return false;
}

PatchId NearestFrontier(const SearchSpace& space,
                        const SearchWorkspace& workspace,
                        const Eigen::Vector3d& goal) {
  PatchId best = kNoPatchId;
  // Ties go by place, not by the order in which tiles were touched.
  std::tuple<double, double, double, double> best_rank(
      std::numeric_limits<double>::infinity(), 0, 0, 0);
  for (std::size_t slot = 0; slot < space.slots().size(); ++slot) {
    const SearchNode* nodes = workspace.NodesIfAny(static_cast<int>(slot));
    if (nodes == nullptr) continue;
    const SearchSpace::Slot& s = space.slots()[slot];
    for (std::uint32_t i = 0; i < s.tile->size(); ++i) {
      if (!workspace.Reached(nodes[i])) continue;
      const Eigen::Vector3d p = space.Position(s.base + i);
      const std::tuple rank((p - goal).squaredNorm(), p.x(), p.y(), p.z());
      if (rank >= best_rank || !HasRefusedMove(*s.tile, i)) continue;
      best_rank = rank;
      best = s.base + i;
    }
  }
  return best;
}

int RefusedDirectionTowards(const SearchSpace& space, PatchId patch, const Eigen::Vector3d& goal) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  const Eigen::Vector2d towards = (goal - space.Position(patch)).head<2>();
  int best = 0;
  double best_progress = -std::numeric_limits<double>::infinity();
  for (int k = 0; k < 8; ++k) {
    if (slot.tile->moves[patch - slot.base][k].cost != Move::kNone) continue;
    const Eigen::Vector2d step(kStepX[k], kStepY[k]);
    const double progress = towards.dot(step.normalized());
    if (progress <= best_progress) continue;
    best_progress = progress;
    best = k;
  }
  return best;
}

}  // namespace

std::string Explanation::ToString() const {
  const absl::string_view unit = kind == Obstruction::kSlope ? "rad" : "m";
  const std::string at = absl::StrFormat("at (%.2f, %.2f, %.2f)", where.x(), where.y(), where.z());
  if (kind == Obstruction::kUnknown && value == 0.0) return "unknown ground " + at;
  return absl::StrFormat("%s of %.2f %s %s", strata::ToString(kind), value, unit, at);
}

absl::StatusOr<Explanation> WhyNotStand(SearchSpace& space, PatchId patch) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles,
                          LoadAround(space.source(), slot.tile->key));
  const TileReasons reasons(space, slot, tiles);
  return reasons.WhyNotStand(reasons.SurfaceOf(patch));
}

absl::StatusOr<Explanation> WhyNoFurther(SearchSpace& space,
                                         const SearchWorkspace& workspace,
                                         PatchId goal) {
  const Eigen::Vector3d goal_position = space.Position(goal);
  const PatchId patch = NearestFrontier(space, workspace, goal_position);
  if (patch == kNoPatchId) return Explanation{};
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles,
                          LoadAround(space.source(), slot.tile->key));
  const TileReasons reasons(space, slot, tiles);
  return reasons.WhyNoMove(reasons.SurfaceOf(patch),
                           RefusedDirectionTowards(space, patch, goal_position));
}

}  // namespace strata
