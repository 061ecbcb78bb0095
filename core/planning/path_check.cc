#include "core/planning/path_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"
#include "core/planning/explain.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/route.h"

namespace strata {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How far waypoints may be off their line, in cells, for being rounded.
constexpr double kRounding = 0.005;
constexpr double kRoundingM = 0.001;

int DirectionOf(int dx, int dy) {
  for (int k = 0; k < 8; ++k) {
    if (kStepX[k] == dx && kStepY[k] == dy) return k;
  }
  return -1;
}

CellIndex CellAt(const Vector2d& cells) {
  return {static_cast<std::int32_t>(std::floor(cells.x())),
          static_cast<std::int32_t>(std::floor(cells.y()))};
}

Vector2d MiddleOf(CellIndex cell) { return {cell.x + 0.5, cell.y + 0.5}; }

// A line between two waypoints, seen from above, in cells.
struct Line {
  Vector2d from, along;
  double length;
  Vector2d At(double t) const { return from + t * along; }
  // Where it leaves [low, low + 1) of one axis.
  double Leaves(int axis, int low) const {
    if (along[axis] == 0.0) return std::numeric_limits<double>::infinity();
    return (low + (along[axis] > 0.0 ? 1 : 0) - from[axis]) / along[axis];
  }
  double DistanceTo(const Vector2d& p) const {
    return std::abs(along.x() * (p - from).y() - along.y() * (p - from).x()) / length;
  }
};

class Checker {
 public:
  Checker(SearchSpace& space, const std::vector<Vector3d>& waypoints, const Stop& stop)
      : space_(space),
        waypoints_(waypoints),
        stop_(stop),
        cell_m_(space.checks().cell_size_m),
        height_tolerance_m_(space.checks().profile.max_step_m + kWaypointToleranceM) {}

  absl::StatusOr<PathCheck> Run() {
    PathCheck check;
    check.tiles = TilesUnder(waypoints_, cell_m_);
    for (std::size_t i = 1; i < waypoints_.size(); ++i) {
      check.length_m += (waypoints_[i] - waypoints_[i - 1]).norm();
    }
    STRATA_RETURN_IF_ERROR(Walk());
    STRATA_RETURN_IF_ERROR(space_.status());
    check.valid = holds_;
    check.valid_m = holds_ ? check.length_m : valid_m_;
    check.message = "valid";
    if (holds_) return check;
    check.message = absl::StrFormat("no longer valid after %.2f m: %s", valid_m_, why_.ToString());
    check.where = why_.where;
    check.obstruction = why_.kind;
    check.obstruction_value = why_.value;
    check.inferred = why_.inferred;
    return check;
  }

 private:
  absl::Status Walk() {
    STRATA_RETURN_IF_ERROR(Start());
    for (std::size_t i = 1; holds_ && i < waypoints_.size(); ++i) {
      STRATA_RETURN_IF_ERROR(Follow(waypoints_[i - 1], waypoints_[i]));
      if (holds_) CheckHeight(waypoints_[i]);
      if (holds_) valid_m_ += (waypoints_[i] - waypoints_[i - 1]).norm();
    }
    return absl::OkStatus();
  }

  absl::Status Start() {
    const Vector3d& begin = waypoints_.front();
    for (const PatchId patch : space_.FindCell(CellAt(begin.head<2>() / cell_m_))) {
      if (patch_ == kNoPatchId || std::abs(space_.Height(patch) - begin.z()) <
                                      std::abs(space_.Height(patch_) - begin.z())) {
        patch_ = patch;
      }
    }
    if (patch_ == kNoPatchId) {
      Fail({Obstruction::kUnknown, 0.0, begin});
      return absl::OkStatus();
    }
    CheckHeight(begin);
    if (!holds_ || space_.Danger(patch_) >= 0.0F) return absl::OkStatus();
    STRATA_ASSIGN_OR_RETURN(const Explanation why, WhyNotStand(space_, patch_));
    Fail(why);
    return absl::OkStatus();
  }

  // The surface is not where the path is.
  void CheckHeight(const Vector3d& waypoint) {
    const double above_m = space_.Height(patch_) - waypoint.z();
    if (std::abs(above_m) <= height_tolerance_m_) return;
    const Obstruction kind = above_m > 0.0 ? Obstruction::kObstacle : Obstruction::kDrop;
    Fail({kind, std::abs(above_m), {waypoint.x(), waypoint.y(), space_.Height(patch_)}});
  }

  absl::Status Follow(const Vector3d& from, const Vector3d& to) {
    Line line = {from.head<2>() / cell_m_, (to - from).head<2>() / cell_m_, 0.0};
    line.length = line.along.norm();
    if (line.length == 0.0) return absl::OkStatus();
    const double rounding = std::max(kRounding, kRoundingM / cell_m_) / line.length;
    double t = 0.0;
    for (int cells = 0;; ++cells) {
      if (cells % 1024 == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      const CellIndex cell = space_.CellOfPatch(patch_);
      const double t_x = std::max(t, line.Leaves(0, cell.x));
      const double t_y = std::max(t, line.Leaves(1, cell.y));
      const double leaves = std::min(t_x, t_y);
      STRATA_RETURN_IF_ERROR(CheckClear(line, t, std::min(leaves, 1.0)));
      if (holds_ && leaves < 1.0 - rounding) {
        STRATA_RETURN_IF_ERROR(Enter(line, t_x, t_y, rounding, &t));
      }
      if (!holds_) valid_m_ += std::clamp(t, 0.0, 1.0) * (to - from).norm();
      if (!holds_ || leaves >= 1.0 - rounding) return absl::OkStatus();
    }
  }

  // Between two places of the line in the present cell.
  absl::Status CheckClear(const Line& line, double enter, double exit) {
    const Vector2d middle = MiddleOf(space_.CellOfPatch(patch_));
    // Through the middle: whoever may stand there and enter is clear.
    if (line.DistanceTo(middle) <= 4.0 * kRounding) return absl::OkStatus();
    const double offset =
        std::max((line.At(enter) - middle).norm(), (line.At(exit) - middle).norm());
    const double needed_m = space_.checks().profile.radius_m + offset * cell_m_;
    if (space_.EdgeDistance(patch_) + 2.0 * kRoundingM >= needed_m) return absl::OkStatus();
    // EdgeDistance is rounded down; what is nearest is then as far away as it must be.
    STRATA_ASSIGN_OR_RETURN(const Explanation why,
                            WhyTooNear(space_, patch_, needed_m - 2.0 * kRoundingM));
    if (why.kind != Obstruction::kNone) Fail(why);
    return absl::OkStatus();
  }

  // Goes on into the next cell of the line; `t` becomes where that is entered.
  absl::Status Enter(const Line& line, double t_x, double t_y, double rounding, double* t) {
    const int dx = line.along.x() > 0.0 ? 1 : -1;
    const int dy = line.along.y() > 0.0 ? 1 : -1;
    const bool corner = std::abs(t_x - t_y) < rounding;
    const int across = DirectionOf(corner || t_x < t_y ? dx : 0, corner || t_y < t_x ? dy : 0);
    const PatchId from = patch_;
    if (Move(line, across, std::max(corner ? std::max(t_x, t_y) : 0.0, std::min(t_x, t_y)), t)) {
      return absl::OkStatus();
    }
    // Past a corner the line may also touch one of the two cells beside it.
    if (corner && (Detour(DirectionOf(dx, 0), DirectionOf(0, dy)) ||
                   Detour(DirectionOf(0, dy), DirectionOf(dx, 0)))) {
      *t = std::max(t_x, t_y);
      return absl::OkStatus();
    }
    STRATA_RETURN_IF_ERROR(space_.status());
    STRATA_ASSIGN_OR_RETURN(Explanation why, WhyNoMove(space_, from, across));
    if (why.kind == Obstruction::kNone) {  // a gap, but not along the line
      why = {Obstruction::kUnknown, 0.0, space_.Position(from)};
    }
    Fail(why);
    return absl::OkStatus();
  }

  bool Move(const Line& line, int direction, double enters, double* t) {
    std::uint32_t cost = 0;
    int cells = 0;
    const PatchId to = space_.Follow(patch_, direction, &cost, &cells);
    if (to == kNoPatchId) return false;
    if (cells > 1) {  // from middle to middle
      const Vector2d landing = MiddleOf(space_.CellOfPatch(to));
      enters = (landing - line.from).dot(line.along) / (line.length * line.length);
      if (line.DistanceTo(landing) > 4.0 * kRounding ||
          enters * line.length > line.length + 4.0 * kRounding) {
        return false;
      }
    }
    patch_ = to;
    *t = enters;
    return true;
  }

  bool Detour(int first, int second) {
    std::uint32_t cost = 0;
    int cells = 0;
    const PatchId beside = space_.Follow(patch_, first, &cost, &cells);
    if (beside == kNoPatchId || cells != 1) return false;
    const PatchId to = space_.Follow(beside, second, &cost, &cells);
    if (to == kNoPatchId || cells != 1) return false;
    patch_ = to;
    return true;
  }

  void Fail(Explanation why) {
    holds_ = false;
    why_ = std::move(why);
  }

  SearchSpace& space_;
  const std::vector<Vector3d>& waypoints_;
  const Stop& stop_;
  const double cell_m_;
  const double height_tolerance_m_;
  PatchId patch_ = kNoPatchId;  // where the walk is
  bool holds_ = true;
  double valid_m_ = 0.0;
  Explanation why_;
};

}  // namespace

absl::Status ValidateWaypoints(const std::vector<Eigen::Vector3d>& waypoints, double cell_size_m) {
  if (waypoints.empty() || waypoints.size() > kMaxWaypoints) {
    return absl::InvalidArgumentError(
        absl::StrCat("waypoints: ", waypoints.size(), " are not between 1 and ", kMaxWaypoints));
  }
  double tiles = 0.0;
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Vector3d& p = waypoints[i];
    if (!p.allFinite() || p.head<2>().cwiseAbs().maxCoeff() >= cell_size_m * kMaxCellIndex) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "waypoint %d: (%g, %g, %g) is not in the map's range", i, p.x(), p.y(), p.z()));
    }
    if (i > 0) tiles += (p - waypoints[i - 1]).head<2>().lpNorm<1>() / (cell_size_m * kTileCells);
  }
  if (tiles <= static_cast<double>(kMaxPathTiles)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "waypoints: the path crosses %.0f tiles, at most %d are checked at once; ask in parts",
      tiles,
      kMaxPathTiles));
}

std::vector<TileKey> TilesUnder(const std::vector<Eigen::Vector3d>& waypoints, double cell_size_m) {
  const double tile_m = cell_size_m * kTileCells;
  std::vector<TileKey> tiles;
  const auto add = [&tiles](const Vector2d& p) {
    const CellIndex tile = CellAt(p);
    tiles.push_back({0, tile.x, tile.y});
  };
  add(waypoints.front().head<2>() / tile_m);
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Vector2d from = waypoints[i - 1].head<2>() / tile_m;
    const Vector2d to = waypoints[i].head<2>() / tile_m;
    std::vector<double> borders = {0.0, 1.0};
    for (int axis = 0; axis < 2; ++axis) {
      const auto [low, high] = std::minmax(from[axis], to[axis]);
      for (double border = std::ceil(low); border <= high && low < high; border += 1.0) {
        borders.push_back((border - from[axis]) / (to[axis] - from[axis]));
      }
    }
    std::sort(borders.begin(), borders.end());
    for (std::size_t k = 1; k < borders.size(); ++k) {
      add(from + 0.5 * (borders[k - 1] + borders[k]) * (to - from));
    }
  }
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

absl::StatusOr<PathCheck> CheckPath(SearchSpace& space,
                                    const std::vector<Eigen::Vector3d>& waypoints,
                                    const Stop& stop) {
  return Checker(space, waypoints, stop).Run();
}

}  // namespace strata
