#include "tests/core/planning/plain_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

#include "core/mls/local_plane.h"
#include "core/mls/traversability.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/prepared_tile.h"

namespace strata::testing {
namespace {

constexpr double kTolerance = 1e-4;

double DistanceToSquare(double dx, double dy, double cell_size) {
  const double x = std::max(0.0, std::abs(dx) - 0.5 * cell_size);
  const double y = std::max(0.0, std::abs(dy) - 0.5 * cell_size);
  return std::hypot(x, y);
}

}  // namespace

PlainPlanner::PlainPlanner(const DrawnMap& map, const RobotProfile& profile, double cell_size_m)
    : profile_(profile),
      cell_size_(cell_size_m),
      footprint_(std::hypot(profile.radius_m, cell_size_m / std::sqrt(2.0))) {
  for (const auto& [cell, column] : map.columns()) {
    for (const DrawnSurface& s : column) {
      columns_[cell].push_back(static_cast<int>(patches_.size()));
      patches_.push_back({cell,
                          static_cast<float>(s.z_m),
                          static_cast<float>(s.z_m) - static_cast<float>(s.depth_m),
                          static_cast<float>(s.sigma_m),
                          s.underside,
                          -1.0,
                          {}});
    }
  }
  std::vector<Patch*> undersides;
  for (Patch& patch : patches_) {
    for (const double deck : UnseenDecks(patch.cell)) {
      const bool over_floor = patches_[columns_[patch.cell].front()].z < patch.z - 1.0;
      if (over_floor && patch.z <= deck - 0.25 && patch.z >= deck - 1.0) {
        undersides.push_back(&patch);
      }
    }
  }
  for (Patch* patch : undersides) patch->underside = true;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (!patches_[i].underside) FindEdges(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (patches_[i].underside) continue;
    const double distance = EdgeDistance(patches_[i].cell, patches_[i].z);
    if (distance >= footprint_) patches_[i].danger = DangerAt(static_cast<int>(i), distance);
  }
  for (std::size_t i = 0; i < patches_.size(); ++i) FindMoves(static_cast<int>(i));
}

double PlainPlanner::Rise(double cells) const {
  return std::max(profile_.max_step_m, cells * cell_size_ * std::tan(profile_.max_slope_rad)) +
         kTolerance;
}

PlainPlanner::Meeting PlainPlanner::Meet(CellIndex cell, double z, double rise) const {
  Meeting meeting;
  const auto column = columns_.find(cell);
  if (column == columns_.end()) return meeting;
  // The top of a deck that was seen from below only could be where the robot is.
  const auto may_be_deck = [&](const Patch& patch) {
    return patch.underside && patch.z <= z + 0.1F && patch.z >= z - std::max(rise, 1.0);
  };
  const bool grounded = std::any_of(column->second.begin(), column->second.end(), [&](int i) {
    return !patches_[i].underside && std::abs(patches_[i].z - z) <= rise;
  });
  double hidden_below = -1e9;
  for (const int i : column->second) {
    if (!grounded && may_be_deck(patches_[i])) hidden_below = patches_[i].z;
  }
  for (const int i : column->second) {
    const Patch& patch = patches_[i];
    if (may_be_deck(patch) || patch.z < hidden_below) continue;
    const double dz = patch.z - z;
    if (patch.bottom <= z + rise) meeting.hole = false;
    if (dz > 0 && patch.bottom >= z + profile_.height_m - kTolerance) continue;
    if (std::abs(dz) <= rise) {
      if (meeting.ground < 0 || std::abs(dz) < std::abs(patches_[meeting.ground].z - z)) {
        meeting.ground = i;
      }
    } else if (dz > 0) {
      if (meeting.obstacle < 0 || patch.z < patches_[meeting.obstacle].z) meeting.obstacle = i;
    } else if (meeting.drop < 0 || patch.z > patches_[meeting.drop].z) {
      meeting.drop = i;
    }
  }
  const std::vector<double> decks =
      meeting.drop >= 0 && meeting.ground < 0 ? UnseenDecks(cell) : std::vector<double>();
  if (std::any_of(
          decks.begin(), decks.end(), [z](double deck) { return std::abs(deck - z) <= 0.2; })) {
    meeting.drop = -1;
    meeting.hole = meeting.obstacle < 0;
  }
  return meeting;
}

bool PlainPlanner::IsHoleInDeck(CellIndex cell, double z) const {
  // 'o' a hole, 't' a top, 'b' something else.
  const auto look = [&](int dx, int dy) {
    char seen = 'o';
    const auto column = columns_.find({cell.x + dx, cell.y + dy});
    if (column == columns_.end()) return seen;
    for (const int i : column->second) {
      const Patch& patch = patches_[i];
      if (patch.underside) continue;
      if (static_cast<float>(std::abs(patch.z - z)) <=
          static_cast<float>(std::hypot(dx, dy) * cell_size_)) {
        return 't';
      }
      if (patch.z > z - 0.25 && patch.bottom <= z + 1.0) seen = 'b';
    }
    return seen;
  };
  if (look(0, 0) != 'o') return false;
  const int limit = std::min(4, static_cast<int>(0.2 / cell_size_ + 1e-6));
  for (const bool along_x : {true, false}) {
    int holes = 1;
    bool ends = true;
    for (const int sign : {1, -1}) {
      const auto at = [&](int n) { return look(along_x ? sign * n : 0, along_x ? 0 : sign * n); };
      int n = 1;
      while (n <= limit && at(n) == 'o') ++n;
      ends = ends && at(n) == 't';
      holes += n - 1;
    }
    if (ends && holes <= limit) return true;
  }
  return false;
}

std::vector<double> PlainPlanner::UnseenDecks(CellIndex cell) const {
  std::vector<double> decks;
  for (int n = 1; n <= 4; ++n) {
    for (const CellIndex step : {CellIndex{1, 0}, CellIndex{0, 1}}) {
      const auto before = columns_.find({cell.x - n * step.x, cell.y - n * step.y});
      if (before == columns_.end()) continue;
      for (const int i : before->second) {
        const Patch& top = patches_[i];
        bool all = !top.underside;
        for (int m = 0; m < n; ++m) {
          all = all && IsHoleInDeck({cell.x - m * step.x, cell.y - m * step.y}, top.z);
        }
        if (all) decks.push_back(top.z);
      }
    }
  }
  return decks;
}

// Holes from `hole` on, itself included; 999 if the row does not end within max_gap.
int PlainPlanner::Run(CellIndex hole, double z, int dx, int dy) const {
  const double unit = std::hypot(dx, dy);
  for (int n = 1; n * unit * cell_size_ <= profile_.max_gap_m + 1e-6 + unit * cell_size_; ++n) {
    const CellIndex cell = {hole.x + n * dx, hole.y + n * dy};
    if (!Meet(cell, z, Rise((n + 1) * unit)).hole) return n;
  }
  return 999;
}

bool PlainPlanner::Tolerated(CellIndex hole, double z) const {
  constexpr int kAxes[4][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}};
  for (const auto& axis : kAxes) {
    const int cells = Run(hole, z, axis[0], axis[1]) + Run(hole, z, -axis[0], -axis[1]) - 1;
    if (cells * std::hypot(axis[0], axis[1]) * cell_size_ <= profile_.max_gap_m + 1e-6) return true;
  }
  return false;
}

void PlainPlanner::AddMet(CellIndex cell, int seen_from, const Meeting& meeting) {
  if (meeting.ground >= 0) return;
  if (meeting.obstacle >= 0) edges_.push_back({cell, seen_from, meeting.obstacle});
  if (meeting.drop >= 0) edges_.push_back({cell, seen_from, meeting.drop});
}

void PlainPlanner::FindEdges(int i) {
  const Patch& patch = patches_[i];
  for (const int other : columns_[patch.cell]) {
    const Patch& above = patches_[other];
    if (above.z > patch.z && above.bottom - patch.z < profile_.height_m - kTolerance) {
      edges_.push_back({patch.cell, i, -1});
      break;
    }
  }
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      CellIndex cell = {patch.cell.x + dx, patch.cell.y + dy};
      Meeting meeting = Meet(cell, patch.z, profile_.max_step_m + kTolerance);
      AddMet(cell, i, meeting);
      if (meeting.ground >= 0 || !meeting.hole) continue;
      if (!Tolerated(cell, patch.z)) edges_.push_back({cell, i, -1});
      // A footprint behind the hole's first cell.
      const double unit = std::hypot(dx, dy);
      const int behind = static_cast<int>(footprint_ / (unit * cell_size_)) + 1;
      for (int n = 2; n <= behind + 1; ++n) {
        cell = {patch.cell.x + n * dx, patch.cell.y + n * dy};
        meeting = Meet(cell, patch.z, Rise(n * unit));
        AddMet(cell, i, meeting);
        if (meeting.ground >= 0 || meeting.drop >= 0 || !meeting.hole) break;
      }
    }
  }
}

bool PlainPlanner::Concerns(const Edge& edge, double z) const {
  const Patch& from = patches_[edge.seen_from];
  const double off = std::abs(from.z - z);
  if (off > profile_.height_m - kTolerance) return false;
  if (edge.met >= 0 && std::abs(patches_[edge.met].z - z) < off) return false;
  const std::vector<int>& column = columns_.at(from.cell);
  return std::none_of(
      column.begin(), column.end(), [&](int i) { return std::abs(patches_[i].z - z) < off; });
}

double PlainPlanner::EdgeDistance(CellIndex cell, double z) const {
  double nearest = footprint_ + kDangerReachM;
  for (const Edge& edge : edges_) {
    const double dx = (edge.cell.x - cell.x) * cell_size_;
    const double dy = (edge.cell.y - cell.y) * cell_size_;
    const double d = DistanceToSquare(dx, dy, cell_size_);
    if (d < nearest && Concerns(edge, z)) nearest = d;
  }
  return nearest;
}

bool PlainPlanner::DiscFree(CellIndex cell, double z) const {
  const int reach = static_cast<int>(footprint_ / cell_size_) + 1;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      if (DistanceToSquare(dx * cell_size_, dy * cell_size_, cell_size_) >= footprint_) continue;
      const double run = (std::hypot(dx, dy) + 1.0) * cell_size_;
      const double rise =
          profile_.max_step_m + kTolerance + run * (std::tan(profile_.max_slope_rad) + 1e-4);
      const Meeting meeting = Meet({cell.x + dx, cell.y + dy}, z, rise);
      if (meeting.ground < 0 && !meeting.Nothing()) return false;
    }
  }
  return true;
}

double PlainPlanner::DangerAt(int i, double distance) const {
  const Patch& patch = patches_[i];
  // Whole window first, then the four quadrants.
  constexpr int kSquares[5][4] = {
      {-2, 2, -2, 2}, {-2, 0, -2, 0}, {0, 2, -2, 0}, {-2, 0, 0, 2}, {0, 2, 0, 2}};
  std::optional<LocalPlane> plane;
  double bound = 0.0;
  for (const auto& square : kSquares) {
    LocalPlaneFit fit(cell_size_);
    for (int dy = square[2]; dy <= square[3]; ++dy) {
      for (int dx = square[0]; dx <= square[1]; ++dx) {
        const auto column = columns_.find({patch.cell.x + dx, patch.cell.y + dy});
        if (column == columns_.end()) continue;
        const Patch* nearest = nullptr;
        for (const int k : column->second) {
          const Patch& other = patches_[k];
          if (other.underside) continue;
          if (nearest == nullptr || std::abs(other.z - patch.z) <= std::abs(nearest->z - patch.z)) {
            nearest = &other;
          }
        }
        if (nearest == nullptr) continue;
        const double dz = nearest->z - patch.z;
        if (std::abs(dz) > 2.0 * std::hypot(dx, dy) * cell_size_ + 0.05) continue;
        const Surface surface = {.z_m = static_cast<float>(nearest->z),
                                 .sigma_m = static_cast<float>(nearest->sigma)};
        fit.Add(dx, dy, dz, SampleOf(surface, cell_size_));
      }
    }
    const std::optional<LocalPlane> solved = fit.Solve();
    if (&square == &kSquares[0]) {
      if (!solved.has_value()) break;
      plane = solved;
      bound = 0.5 * solved->residual_m;
      if (solved->roughness_m() <= 0.0) break;
    } else if (solved.has_value() && solved->residual_m < bound) {
      plane = solved;
      bound = solved->residual_m;
    }
  }
  double slope = 0.0;
  double roughness = 0.0;
  if (plane.has_value()) {
    slope = plane->slope_rad();
    roughness = plane->roughness_m();
    if (plane->gradient.norm() - kNoiseGate * plane->gradient_sigma >
        std::tan(profile_.max_slope_rad) + 1e-4) {
      return -1.0;
    }
    if (roughness > profile_.max_roughness_m) return -1.0;
  }
  const double nearness = 1.0 - (distance - footprint_) / kDangerReachM;
  return Danger(slope,
                roughness,
                0.0,
                patch.sigma,
                {.max_slope_rad = profile_.max_slope_rad,
                 .max_step_m = profile_.max_step_m,
                 .max_roughness_m = profile_.max_roughness_m,
                 .clearance_m = profile_.height_m}) +
         2.0 * nearness * nearness;
}

int PlainPlanner::OneWay(int i, int dx, int dy, int* cells) const {
  const Patch& patch = patches_[i];
  const double unit = std::hypot(dx, dy);
  for (*cells = 1; (*cells - 1) * unit * cell_size_ <= profile_.max_gap_m + 1e-6; ++*cells) {
    const CellIndex cell = {patch.cell.x + *cells * dx, patch.cell.y + *cells * dy};
    const double rise = *cells == 1 ? profile_.max_step_m + kTolerance : Rise(*cells * unit);
    const Meeting meeting = Meet(cell, patch.z, rise);
    if (meeting.ground >= 0) return meeting.ground;
    if (!meeting.Nothing()) return -1;
  }
  return -1;
}

void PlainPlanner::FindMoves(int i) {
  Patch& patch = patches_[i];
  if (patch.danger < 0.0) return;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      int cells = 0;
      int back = 0;
      const int to = OneWay(i, dx, dy, &cells);
      if (to < 0 || OneWay(to, -dx, -dy, &back) != i || patches_[to].danger < 0.0) continue;
      bool clear = true;
      for (int n = 1; n < cells; ++n) {
        const double z = patch.z + (patches_[to].z - patch.z) * n / cells;
        const CellIndex between = {patch.cell.x + n * dx, patch.cell.y + n * dy};
        clear &= EdgeDistance(between, z) >= footprint_ && DiscFree(between, z);
      }
      if (!clear) continue;
      const double run = cells * std::hypot(dx, dy) * cell_size_;
      const double danger =
          0.5 * (patch.danger + patches_[to].danger) + kGapDanger * (cells - 1.0) / cells;
      patch.moves.emplace_back(to, std::hypot(run, patches_[to].z - patch.z) * (1.0 + danger));
    }
  }
}

void PlainPlanner::AddClasses(const std::function<int(CellIndex)>& class_of,
                              const ClassCosts& costs) {
  const auto factor = [&](const Patch& patch) {
    const auto cost = costs.find(class_of(patch.cell));
    return cost == costs.end() ? 1.0 : cost->second;
  };
  for (Patch& patch : patches_) {
    std::vector<std::pair<int, double>> moves;
    for (const auto& [to, cost] : patch.moves) {
      const double both = 0.5 * (factor(patch) + factor(patches_[to]));
      if (both != kForbiddenClass) moves.emplace_back(to, cost * both);
    }
    patch.moves = std::move(moves);
    if (factor(patch) == kForbiddenClass) patch.danger = -1.0;
  }
}

int PlainPlanner::Place(const PlanEndpoint& endpoint) const {
  const double z = *endpoint.z_m;
  int named = -1;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const bool own = patches_[i].cell.x == std::floor(endpoint.x_m / cell_size_) &&
                     patches_[i].cell.y == std::floor(endpoint.y_m / cell_size_);
    const double off = std::abs(patches_[i].z - z);
    if (!own || off > profile_.height_m + kTolerance) continue;
    if (named < 0 || off < std::abs(patches_[named].z - z)) {
      named = static_cast<int>(i);
    }
  }
  if (named >= 0 && patches_[named].danger >= 0.0) return named;
  int best = -1;
  std::tuple<double, double, double, double> best_rank;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Patch& patch = patches_[i];
    if (patch.danger < 0.0) continue;
    const double x = (patch.cell.x + 0.5) * cell_size_;
    const double y = (patch.cell.y + 0.5) * cell_size_;
    const double d = std::hypot(x - endpoint.x_m, y - endpoint.y_m);
    const double rise =
        profile_.max_step_m + kTolerance + d * (std::tan(profile_.max_slope_rad) + 1e-4);
    const bool same_level = std::abs(patch.z - z) <= rise ||
                            (named >= 0 && std::abs(patch.z - patches_[named].z) <= rise);
    if (d > profile_.radius_m + profile_.max_gap_m || !same_level) continue;
    const std::tuple rank(d, std::abs(patch.z - z), x, y);
    if (best >= 0 && rank >= best_rank) continue;
    best = static_cast<int>(i);
    best_rank = rank;
  }
  return best >= 0 ? best : PlaceOnFloor(endpoint);
}

int PlainPlanner::PlaceOnFloor(const PlanEndpoint& endpoint) const {
  int floor = -1;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Patch& patch = patches_[i];
    const double below = *endpoint.z_m - patch.z;
    const bool own = patch.cell.x == std::floor(endpoint.x_m / cell_size_) &&
                     patch.cell.y == std::floor(endpoint.y_m / cell_size_);
    if (!own || patch.danger < 0.0) continue;
    if (below < 0.0 || below > profile_.height_m + kTolerance) continue;
    if (floor < 0 || patch.z > patches_[floor].z) floor = static_cast<int>(i);
  }
  return floor;
}

double PlainPlanner::Cost(int from, int to) const {
  std::vector<double> cost(patches_.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<std::pair<double, int>> queue;
  cost[from] = 0.0;
  queue.emplace(0.0, from);
  while (!queue.empty()) {
    const auto [negative, i] = queue.top();
    queue.pop();
    if (-negative > cost[i]) continue;
    if (i == to) break;
    for (const auto& [target, price] : patches_[i].moves) {
      if (cost[i] + price >= cost[target]) continue;
      cost[target] = cost[i] + price;
      queue.emplace(-cost[target], target);
    }
  }
  return cost[to];
}

std::string Collision(const DrawnMap& map,
                      const std::vector<Eigen::Vector3d>& waypoints,
                      const RobotProfile& profile,
                      double cell_size_m) {
  const double slope = std::tan(profile.max_slope_rad);
  for (std::size_t w = 1; w < waypoints.size(); ++w) {
    const Eigen::Vector3d along = waypoints[w] - waypoints[w - 1];
    const int steps = static_cast<int>(std::ceil(along.norm() / 0.01)) + 1;
    for (int s = 0; s <= steps; ++s) {
      const Eigen::Vector3d p = waypoints[w - 1] + along * s / steps;
      const int reach = static_cast<int>(profile.radius_m / cell_size_m) + 1;
      const int cx = static_cast<int>(std::floor(p.x() / cell_size_m));
      const int cy = static_cast<int>(std::floor(p.y() / cell_size_m));
      for (int y = cy - reach; y <= cy + reach; ++y) {
        for (int x = cx - reach; x <= cx + reach; ++x) {
          const double dx = (x + 0.5) * cell_size_m - p.x();
          const double dy = (y + 0.5) * cell_size_m - p.y();
          if (DistanceToSquare(dx, dy, cell_size_m) >= profile.radius_m - 1e-6) continue;
          const auto column = map.columns().find({x, y});
          if (column == map.columns().end() || column->second.empty()) continue;
          // What the ground may do under the disc: a step, slope, and what waypoints leave out.
          const double allowed =
              profile.max_step_m + slope * (std::hypot(dx, dy) + cell_size_m) + 0.06;
          bool all_below = true;
          for (const DrawnSurface& surface : column->second) {
            const double top = surface.z_m - p.z();
            const double bottom = top - surface.depth_m;
            if (surface.underside && top <= allowed && top >= -1.0) all_below = false;
            all_below &= top < -allowed;
            if (top > allowed && bottom < profile.height_m - allowed) {
              return absl::StrFormat("(%.3f, %.3f, %.3f) hits %.3f m at cell (%d, %d)",
                                     p.x(),
                                     p.y(),
                                     p.z(),
                                     top,
                                     x,
                                     y);
            }
          }
          if (all_below) {
            return absl::StrFormat(
                "(%.3f, %.3f, %.3f) hangs over cell (%d, %d)", p.x(), p.y(), p.z(), x, y);
          }
        }
      }
    }
  }
  return "";
}

}  // namespace strata::testing
