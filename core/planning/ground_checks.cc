#include "core/planning/ground_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "core/planning/ground_window.h"
#include "core/planning/profile_checks.h"
#include "core/world/plan.h"

namespace strata {
namespace {

constexpr int kReportedHoleCells = 64;

}  // namespace

GroundChecks::GroundChecks(const GroundWindow& window, const ProfileChecks& checks)
    : window_(window), checks_(checks) {
  for (const DiscCell& d : checks.disc) disc_step_.push_back(d.dy * window.width() + d.dx);
  // Cells this close to the window's border are not reached by any disc of the tile.
  const int rim = checks.gap_cells[0] + 1;
  std::vector<GroundEdge> edges;
  for (int y = rim; y < window.width() - rim; ++y) {
    const int row = y * window.width();
    const std::uint32_t end = window.begin(row + window.width() - rim);
    for (std::uint32_t i = window.begin(row + rim); i < end; ++i) CollectEdges(i, &edges);
  }
  IndexEdges(std::move(edges));
  MarkNearCells();
}

Footing GroundChecks::Meet(int cell, float z, float rise_m) const {
  Footing drop;
  Footing obstacle;
  Footing ground;
  float nearest = rise_m;
  for (std::uint32_t i = window_.begin(cell); i < window_.begin(cell + 1); ++i) {
    const WindowSurface& surface = window_.surface(i);
    const float dz = surface.z_m - z;
    if (dz < -rise_m) {
      drop = {Footing::Kind::kDrop, i};
    } else if (dz <= rise_m) {
      if (ground.kind == Footing::Kind::kGround && std::abs(dz) >= nearest) continue;
      nearest = std::abs(dz);
      ground = {Footing::Kind::kGround, i};
    } else if (surface.bottom_m - z < checks_.height_m) {
      if (obstacle.kind == Footing::Kind::kHole) obstacle = {Footing::Kind::kObstacle, i};
    }
  }
  if (ground.kind == Footing::Kind::kGround) return ground;
  return obstacle.kind == Footing::Kind::kObstacle ? obstacle : drop;
}

float GroundChecks::Clearance(std::uint32_t i) const {
  const WindowSurface& surface = window_.surface(i);
  if (i + 1 >= window_.begin(static_cast<int>(surface.cell) + 1)) {
    return std::numeric_limits<float>::infinity();
  }
  return window_.surface(i + 1).bottom_m - surface.z_m;
}

void GroundChecks::CollectEdges(std::uint32_t i, std::vector<GroundEdge>* edges) const {
  const WindowSurface& surface = window_.surface(i);
  const auto cell = static_cast<int>(surface.cell);
  const float z = surface.z_m;
  if (const float free = Clearance(i); free < checks_.height_m) {
    edges->push_back({cell, z, z, Obstruction::kClearance, free});
  }
  for (int k = 0; k < 8; ++k) {
    const int next = cell + window_.Step(k);
    const Footing footing = Meet(next, z, checks_.step_m);
    switch (footing.kind) {
      case Footing::Kind::kGround:
        break;
      case Footing::Kind::kObstacle:
        edges->push_back(
            {next, z, z, Obstruction::kObstacle, window_.surface(footing.surface).z_m - z});
        break;
      case Footing::Kind::kDrop:
        edges->push_back(
            {next, z, z, Obstruction::kDrop, z - window_.surface(footing.surface).z_m});
        break;
      case Footing::Kind::kHole:
        CollectHole(i, k, edges);
        break;
    }
  }
}

void GroundChecks::CollectHole(std::uint32_t i,
                               int direction,
                               std::vector<GroundEdge>* edges) const {
  const WindowSurface& surface = window_.surface(i);
  const float z = surface.z_m;
  int cell = static_cast<int>(surface.cell) + window_.Step(direction);
  if (!HoleIsTolerated(cell, z)) {
    edges->push_back({cell, z, z, Obstruction::kUnknown, 0.0F});
    return;
  }
  for (int n = 0; n < checks_.GapCells(direction); ++n) {
    cell += window_.Step(direction);
    const double length = (n + 2) * checks_.StepLength(direction);
    const Footing footing = Meet(cell, z, checks_.RiseOver(length));
    if (footing.kind == Footing::Kind::kHole) continue;
    const float dz =
        footing.kind == Footing::Kind::kGround ? 0.0F : window_.surface(footing.surface).z_m - z;
    if (footing.kind == Footing::Kind::kObstacle) {
      edges->push_back({cell, z, z, Obstruction::kObstacle, dz});
    } else if (footing.kind == Footing::Kind::kDrop) {
      edges->push_back({cell, z, z, Obstruction::kDrop, -dz});
    }
    return;
  }
}

// Number of further holes from `cell` on in `direction`, up to limit + 1.
int GroundChecks::HoleRun(int cell, float z, int direction, int limit) const {
  for (int n = 0; n <= limit; ++n) {
    cell += window_.Step(direction);
    if (!window_.Inside(cell, 1)) return limit + 1;
    const float rise = checks_.RiseOver((n + 2) * checks_.StepLength(direction));
    if (Meet(cell, z, rise).kind != Footing::Kind::kHole) return n;
  }
  return limit + 1;
}

bool GroundChecks::HoleIsTolerated(int cell, float z) const {
  for (int axis = 0; axis < 4; ++axis) {
    const int limit = checks_.GapCells(axis);
    const int ahead = HoleRun(cell, z, axis, limit);
    if (ahead + 1 > limit) continue;
    if (ahead + 1 + HoleRun(cell, z, axis + 4, limit) <= limit) return true;
  }
  return false;
}

double GroundChecks::HoleWidth(int cell, float z) const {
  double width = 0.0;
  for (int axis = 0; axis < 4; ++axis) {
    const int cells = 1 + HoleRun(cell, z, axis, kReportedHoleCells) +
                      HoleRun(cell, z, axis + 4, kReportedHoleCells);
    if (cells > kReportedHoleCells) continue;
    const double chord = cells * checks_.StepLength(axis);
    if (width == 0.0 || chord < width) width = chord;
  }
  return width;
}

std::uint32_t GroundChecks::OneWayTarget(std::uint32_t i, int direction, int* cells) const {
  const WindowSurface& surface = window_.surface(i);
  auto cell = static_cast<int>(surface.cell);
  const int limit = checks_.GapCells(direction) + 1;
  for (*cells = 1; *cells <= limit; ++*cells) {
    cell += window_.Step(direction);
    const float rise =
        *cells == 1 ? checks_.step_m : checks_.RiseOver(*cells * checks_.StepLength(direction));
    const Footing footing = Meet(cell, surface.z_m, rise);
    if (footing.kind == Footing::Kind::kGround) return footing.surface;
    if (footing.kind != Footing::Kind::kHole) return kNoSurface;
  }
  return kNoSurface;
}

std::uint32_t GroundChecks::Target(std::uint32_t i, int direction, int* cells) const {
  const std::uint32_t there = OneWayTarget(i, direction, cells);
  if (there == kNoSurface) return kNoSurface;
  int cells_back = 0;
  return OneWayTarget(there, direction ^ 4, &cells_back) == i ? there : kNoSurface;
}

// Sorts by cell and height and fuses what lies within a step: a disc's level interval is at least
// two steps wide, so fusing loses nothing.
void GroundChecks::IndexEdges(std::vector<GroundEdge> edges) {
  std::sort(edges.begin(), edges.end(), [](const GroundEdge& a, const GroundEdge& b) {
    return std::tie(a.cell, a.z_low_m, a.kind, a.value) <
           std::tie(b.cell, b.z_low_m, b.kind, b.value);
  });
  edge_first_.assign(static_cast<std::size_t>(window_.cell_count()) + 1, 0);
  for (const GroundEdge& edge : edges) {
    if (!edges_.empty() && edges_.back().cell == edge.cell &&
        edge.z_low_m - edges_.back().z_high_m <= checks_.step_m) {
      edges_.back().z_high_m = edge.z_high_m;
      continue;
    }
    edges_.push_back(edge);
    ++edge_first_[edge.cell + 1];
  }
  for (int cell = 0; cell < window_.cell_count(); ++cell)
    edge_first_[cell + 1] += edge_first_[cell];
}

// Dilates the cells with edges by the square around the disc: rows first, then columns.
void GroundChecks::MarkNearCells() {
  const int width = window_.width();
  const int reach = checks_.disc_cells;
  std::vector<std::uint8_t> rows(static_cast<std::size_t>(window_.cell_count()), 0);
  near_edge_.assign(rows.size(), 0);
  for (int y = 0; y < width; ++y) {
    int last = -2 * width;  // the latest edge to the left, then to the right
    for (int x = 0; x < width; ++x) {
      const int cell = y * width + x;
      if (edge_first_[cell] != edge_first_[cell + 1]) last = x;
      if (x - last <= reach) rows[cell] = 1;
    }
    last = 3 * width;
    for (int x = width - 1; x >= 0; --x) {
      const int cell = y * width + x;
      if (edge_first_[cell] != edge_first_[cell + 1]) last = x;
      if (last - x <= reach) rows[cell] = 1;
    }
  }
  for (int y = 0; y < width; ++y) {
    for (int v = std::max(0, y - reach); v <= std::min(width - 1, y + reach); ++v) {
      std::uint8_t* target = &near_edge_[static_cast<std::size_t>(y) * width];
      const std::uint8_t* source = &rows[static_cast<std::size_t>(v) * width];
      for (int x = 0; x < width; ++x) target[x] |= source[x];
    }
  }
}

const GroundEdge* GroundChecks::BlockingEdge(int cell, float z) const {
  const GroundEdge* other_level = nullptr;
  const float behind = checks_.footprint_m + 1.5F * static_cast<float>(checks_.cell_size_m);
  for (std::size_t k = 0; k < disc_step_.size(); ++k) {
    const DiscCell& d = checks_.disc[k];
    const bool within = d.distance_m < checks_.footprint_m;
    if (!within && (other_level == nullptr || d.distance_m >= behind)) break;
    const int at = cell + disc_step_[k];
    for (std::uint32_t e = edge_first_[at]; e < edge_first_[at + 1]; ++e) {
      const GroundEdge& edge = edges_[e];
      const float off = std::max(edge.z_low_m - z, z - edge.z_high_m);
      if (off <= checks_.step_m) return &edge;
      if (within && off <= d.level_m && other_level == nullptr) other_level = &edge;
    }
  }
  return other_level;
}

float GroundChecks::EdgeDistance(int cell, float z) const {
  if (near_edge_[cell] == 0) return checks_.reach_m;
  for (std::size_t k = 0; k < disc_step_.size(); ++k) {
    const DiscCell& d = checks_.disc[k];
    const int at = cell + disc_step_[k];
    for (std::uint32_t e = edge_first_[at]; e < edge_first_[at + 1]; ++e) {
      const GroundEdge& edge = edges_[e];
      if (edge.z_low_m - z <= d.level_m && z - edge.z_high_m <= d.level_m) return d.distance_m;
    }
  }
  return checks_.reach_m;
}

bool GroundChecks::GapIsClear(std::uint32_t from,
                              std::uint32_t to,
                              int direction,
                              int cells) const {
  const WindowSurface& a = window_.surface(from);
  const WindowSurface& b = window_.surface(to);
  for (int n = 1; n < cells; ++n) {
    const float z = a.z_m + (b.z_m - a.z_m) * static_cast<float>(n) / static_cast<float>(cells);
    const int cell = static_cast<int>(a.cell) + n * window_.Step(direction);
    if (EdgeDistance(cell, z) < checks_.footprint_m) return false;
  }
  return true;
}

}  // namespace strata
