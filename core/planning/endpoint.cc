#include "core/planning/endpoint.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <tuple>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/explain.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {
namespace {

constexpr double kMaxCell = 1 << 30;

// So far around an endpoint, and in so many tiles, the nearest place to stand is looked for.
constexpr int kNearestRings = 64;
constexpr int kNearestTiles = 64;

CellIndex CellAt(const PlanEndpoint& endpoint, double cell_size_m) {
  return {static_cast<std::int32_t>(std::floor(endpoint.x_m / cell_size_m)),
          static_cast<std::int32_t>(std::floor(endpoint.y_m / cell_size_m))};
}

// The surface of the endpoint's cell that is meant; kNoPatchId if the level does not exist or no
// surface is within the robot's height of z.
PatchId Choose(SearchSpace& space,
               const PlanEndpoint& endpoint,
               const SearchSpace::Column& column) {
  if (endpoint.level.has_value()) {
    const auto level = static_cast<std::int64_t>(*endpoint.level);
    return level >= 0 && level < static_cast<std::int64_t>(column.size())
               ? column[static_cast<std::size_t>(level)]
               : kNoPatchId;
  }
  if (!endpoint.z_m.has_value()) return column.empty() ? kNoPatchId : column.front();
  PatchId best = kNoPatchId;
  double best_off = space.checks().height_m;
  for (const PatchId patch : column) {
    const double off = std::abs(space.Height(patch) - *endpoint.z_m);
    if (off > best_off || (off == best_off && best != kNoPatchId)) continue;
    best = patch;
    best_off = off;
  }
  return best;
}

// The highest surface of the endpoint's cell on which a robot stands whose body reaches z;
// kNoPatchId if there is none.
PatchId FloorBelow(SearchSpace& space,
                   const PlanEndpoint& endpoint,
                   const SearchSpace::Column& column) {
  if (!endpoint.z_m.has_value()) return kNoPatchId;
  PatchId best = kNoPatchId;
  for (const PatchId patch : column) {
    const double below = *endpoint.z_m - space.Height(patch);
    if (below < 0.0 || below > space.checks().height_m || space.Danger(patch) < 0.0F) continue;
    if (best == kNoPatchId || space.Height(patch) > space.Height(best)) best = patch;
  }
  return best;
}

// Why no surface of the endpoint's cell is meant.
std::string WhyNoneChosen(SearchSpace& space,
                          const PlanEndpoint& endpoint,
                          const SearchSpace::Column& column) {
  const std::string place = absl::StrFormat("(%.2f, %.2f)", endpoint.x_m, endpoint.y_m);
  if (column.empty()) return absl::StrCat("no surface at ", place);
  if (endpoint.level.has_value()) {
    return absl::StrCat(
        "no level ", *endpoint.level, " at ", place, ", which has ", column.size(), " surfaces");
  }
  return absl::StrFormat("no surface within %.2f m, the robot's height, of z = %.2f at %s",
                         space.checks().profile.height_m,
                         *endpoint.z_m,
                         place);
}

// "(1.05, 2.15, 2.90), 2.90 m above the z asked for".
std::string DescribeNearest(const PlanEndpoint& endpoint, const Eigen::Vector3d& nearest) {
  std::string text = absl::StrFormat("(%.2f, %.2f, %.2f)", nearest.x(), nearest.y(), nearest.z());
  if (endpoint.z_m.has_value()) {
    const double up = nearest.z() - *endpoint.z_m;
    absl::StrAppendFormat(
        &text, ", %.2f m %s the z asked for", std::abs(up), up < 0.0 ? "below" : "above");
  }
  return text;
}

// True if a patch of the endpoint's surroundings, `d` away, is on the level that the endpoint
// means; `named` is the patch of its own cell.
bool SameLevel(SearchSpace& space,
               const PlanEndpoint& endpoint,
               PatchId named,
               PatchId patch,
               std::uint32_t level,
               double d) {
  if (endpoint.level.has_value()) return static_cast<std::int64_t>(level) == *endpoint.level;
  if (!endpoint.z_m.has_value()) return level == 0;
  const ProfileChecks& checks = space.checks();
  const double rise = checks.step_m + d * checks.slope_tan;
  const double z = space.Height(patch);
  return std::abs(z - *endpoint.z_m) <= rise ||
         (named != kNoPatchId && std::abs(z - space.Height(named)) <= rise);
}

// Where an endpoint goes that cannot be stood on; kNoPatchId if nowhere.
PatchId Snap(SearchSpace& space, const PlanEndpoint& endpoint, PatchId named) {
  const ProfileChecks& checks = space.checks();
  const double reach = checks.profile.radius_m + checks.profile.max_gap_m;
  const int cells = static_cast<int>(reach / checks.cell_size_m) + 1;
  const CellIndex middle = CellAt(endpoint, checks.cell_size_m);
  PatchId best = kNoPatchId;
  std::tuple<double, double, double, double> best_rank;
  for (int dy = -cells; dy <= cells; ++dy) {
    for (int dx = -cells; dx <= cells; ++dx) {
      std::uint32_t level = 0;
      for (const PatchId patch : space.FindCell({middle.x + dx, middle.y + dy})) {
        const std::uint32_t own_level = level++;
        if (space.Danger(patch) < 0.0F) continue;
        const Eigen::Vector3d p = space.Position(patch);
        const double d = std::hypot(p.x() - endpoint.x_m, p.y() - endpoint.y_m);
        if (d > reach || !SameLevel(space, endpoint, named, patch, own_level, d)) continue;
        const double off = std::abs(p.z() - endpoint.z_m.value_or(p.z()));
        const std::tuple rank(d, off, p.x(), p.y());
        if (best != kNoPatchId && rank >= best_rank) continue;
        best = patch;
        best_rank = rank;
      }
    }
  }
  return best;
}

// Nearest place to stand, tiles ring by ring; in height too where the endpoint names one.
class NearestStandable {
 public:
  NearestStandable(SearchSpace& space, const PlanEndpoint& endpoint, std::optional<double> z)
      : space_(space),
        endpoint_(endpoint),
        z_(z),
        middle_(TileOfCell(CellAt(endpoint, space.checks().cell_size_m))) {}

  // Nothing where none of the tiles looked at has a place.
  std::optional<Eigen::Vector3d> Find() {
    for (int ring = 0; ring <= kNearestRings; ++ring) {
      is_nearer_possible_ = false;
      for (int d = -ring; d <= ring; ++d) {
        LookAt(d, -ring);
        if (ring > 0) LookAt(d, ring);
        if (std::abs(d) == ring) continue;
        LookAt(-ring, d);
        LookAt(ring, d);
      }
      if (!is_nearer_possible_) break;
    }
    return best_;
  }

 private:
  // From the endpoint to the tile, on the plane.
  double DistanceTo(const TileKey& key) const {
    const double size_m = kTileCells * space_.checks().cell_size_m;
    const double dx =
        std::max({key.x * size_m - endpoint_.x_m, endpoint_.x_m - (key.x + 1) * size_m, 0.0});
    const double dy =
        std::max({key.y * size_m - endpoint_.y_m, endpoint_.y_m - (key.y + 1) * size_m, 0.0});
    return std::hypot(dx, dy);
  }

  void LookAt(int dx, int dy) {
    const TileKey key{middle_.level, middle_.x + dx, middle_.y + dy};
    if (tiles_ == kNearestTiles || DistanceTo(key) >= distance_) return;
    is_nearer_possible_ = true;
    if (space_.source().Version(key) == 0) return;
    const int slot = space_.SlotOf(key);
    ++tiles_;
    if (slot < 0) return;
    const SearchSpace::Slot at = space_.At(slot);
    for (std::uint32_t place = 0; place < at.tile->standing.places(); ++place) {
      const PatchId patch = at.base + place;
      if (!at.tile->CanStand(place) || space_.Danger(patch) < 0.0F) continue;
      const Eigen::Vector3d p = space_.Position(patch);
      const double distance =
          (p - Eigen::Vector3d(endpoint_.x_m, endpoint_.y_m, z_.value_or(p.z()))).norm();
      if (distance >= distance_) continue;
      distance_ = distance;
      best_ = p;
    }
  }

  SearchSpace& space_;
  const PlanEndpoint& endpoint_;
  const std::optional<double> z_;
  const TileKey middle_;
  int tiles_ = 0;
  bool is_nearer_possible_ = true;
  double distance_ = std::numeric_limits<double>::infinity();
  std::optional<Eigen::Vector3d> best_;
};

}  // namespace

absl::Status ValidateEndpoint(absl::string_view name,
                              const PlanEndpoint& endpoint,
                              double cell_size_m) {
  const double bound = kMaxCell * cell_size_m;
  if (!(std::abs(endpoint.x_m) < bound && std::abs(endpoint.y_m) < bound)) {
    return absl::InvalidArgumentError(absl::StrCat(name,
                                                   " = (",
                                                   endpoint.x_m,
                                                   ", ",
                                                   endpoint.y_m,
                                                   ") is not within ",
                                                   bound,
                                                   " m of the origin"));
  }
  if (endpoint.z_m.has_value() && !std::isfinite(*endpoint.z_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": z_m = ", *endpoint.z_m, " is not finite"));
  }
  return absl::OkStatus();
}

absl::StatusOr<EndpointMatch> MatchEndpoint(SearchSpace& space, const PlanEndpoint& endpoint) {
  EndpointMatch match;
  const CellIndex cell = CellAt(endpoint, space.checks().cell_size_m);
  const SearchSpace::Column column = space.FindCell(cell);
  STRATA_RETURN_IF_ERROR(space.status());
  const PatchId patch = Choose(space, endpoint, column);
  if (patch != kNoPatchId && space.Danger(patch) >= 0.0F) {
    match.patch = patch;
    return match;
  }
  std::optional<double> z = endpoint.z_m;
  if (patch == kNoPatchId) {
    match.reason = {
        Obstruction::kUnknown, 0.0, Eigen::Vector3d(endpoint.x_m, endpoint.y_m, z.value_or(0.0))};
    match.message = WhyNoneChosen(space, endpoint, column);
  } else {
    STRATA_ASSIGN_OR_RETURN(match.reason, WhyNotStand(space, patch));
    match.message = absl::StrFormat("cannot stand at (%.2f, %.2f, %.2f): %s",
                                    endpoint.x_m,
                                    endpoint.y_m,
                                    space.Height(patch),
                                    match.reason.ToString());
    if (!z.has_value()) z = space.Height(patch);
  }
  match.patch = Snap(space, endpoint, patch);
  if (match.patch == kNoPatchId) match.patch = FloorBelow(space, endpoint, column);
  STRATA_RETURN_IF_ERROR(space.status());
  if (match.patch != kNoPatchId) {
    const Eigen::Vector3d p = space.Position(match.patch);
    match.message = absl::StrFormat("moved %.2f m to (%.2f, %.2f, %.2f), %s",
                                    std::hypot(p.x() - endpoint.x_m, p.y() - endpoint.y_m),
                                    p.x(),
                                    p.y(),
                                    p.z(),
                                    match.message);
    return match;
  }
  match.nearest = NearestStandable(space, endpoint, z).Find();
  STRATA_RETURN_IF_ERROR(space.status());
  if (match.nearest.has_value()) {
    absl::StrAppend(
        &match.message, "; nearest place to stand ", DescribeNearest(endpoint, *match.nearest));
  }
  return match;
}

}  // namespace strata
