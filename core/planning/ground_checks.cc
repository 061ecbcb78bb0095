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
  const int rim = checks.sight_cells;
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
  Footing footing;
  float nearest = rise_m;
  for (std::uint32_t i = window_.begin(cell); i < window_.begin(cell + 1); ++i) {
    const WindowSurface& surface = window_.surface(i);
    const float dz = surface.z_m - z;
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
  return footing;
}

float GroundChecks::Clearance(std::uint32_t i) const {
  const WindowSurface& surface = window_.surface(i);
  if (i + 1 >= window_.begin(static_cast<int>(surface.cell) + 1)) {
    return std::numeric_limits<float>::infinity();
  }
  return window_.surface(i + 1).bottom_m - surface.z_m;
}

// An edge to fill in, for the levels that surface i is the nearest to in its cell.
GroundEdge GroundChecks::Seen(std::uint32_t i) const {
  const WindowSurface& surface = window_.surface(i);
  const auto cell = static_cast<int>(surface.cell);
  GroundEdge edge = {.cell = cell,
                     .z_low_m = surface.z_m - checks_.height_m,
                     .z_high_m = surface.z_m + checks_.height_m,
                     .seen_from_m = surface.z_m};
  if (i > window_.begin(cell)) {
    edge.z_low_m = std::max(edge.z_low_m, 0.5F * (surface.z_m + window_.surface(i - 1).z_m));
  }
  if (i + 1 < window_.begin(cell + 1)) {
    edge.z_high_m = std::min(edge.z_high_m, 0.5F * (surface.z_m + window_.surface(i + 1).z_m));
  }
  return edge;
}

void GroundChecks::CollectEdges(std::uint32_t i, std::vector<GroundEdge>* edges) const {
  GroundEdge seen = Seen(i);
  const int cell = seen.cell;
  const float z = seen.seen_from_m;
  if (const float free = Clearance(i); free < checks_.height_m) {
    edges->push_back(seen);
    edges->back().kind = Obstruction::kClearance;
    edges->back().value = free;
  }
  for (int k = 0; k < 8; ++k) {
    seen.cell = cell + window_.Step(k);
    const Footing footing = Meet(seen.cell, z, checks_.step_m);
    if (footing.ground != kNoSurface) continue;
    CollectMet(seen, footing, edges);
    if (!footing.open) continue;
    if (!HoleIsTolerated(seen.cell, z)) {
      edges->push_back(seen);
      edges->back().kind = Obstruction::kUnknown;
    }
    CollectBehind(seen, k, edges);
  }
}

// Levels nearer to what is met than to what it is seen from have the same edge the other way round.
void GroundChecks::CollectMet(GroundEdge seen,
                              const Footing& footing,
                              std::vector<GroundEdge>* edges) const {
  const float z = seen.seen_from_m;
  if (footing.above != kNoSurface) {
    const float dz = window_.surface(footing.above).z_m - z;
    edges->push_back(seen);
    edges->back().kind = Obstruction::kObstacle;
    edges->back().value = dz;
    edges->back().z_high_m = std::min(seen.z_high_m, z + 0.5F * dz);
  }
  if (footing.below != kNoSurface) {
    const float dz = z - window_.surface(footing.below).z_m;
    edges->push_back(seen);
    edges->back().kind = Obstruction::kDrop;
    edges->back().value = dz;
    edges->back().z_low_m = std::max(seen.z_low_m, z - 0.5F * dz);
  }
}

// `seen` is at a hole next to the surface that looks in `direction`.
void GroundChecks::CollectBehind(GroundEdge seen,
                                 int direction,
                                 std::vector<GroundEdge>* edges) const {
  for (int n = 2; n <= checks_.BehindCells(direction) + 1; ++n) {
    seen.cell += window_.Step(direction);
    const float rise = checks_.RiseOver(n * checks_.StepLength(direction));
    const Footing footing = Meet(seen.cell, seen.seen_from_m, rise);
    if (footing.ground != kNoSurface) return;
    CollectMet(seen, footing, edges);
    if (!footing.open || footing.below != kNoSurface) return;
  }
}

// Number of further holes from `cell` on in `direction`, up to limit + 1.
int GroundChecks::HoleRun(int cell, float z, int direction, int limit) const {
  for (int n = 0; n <= limit; ++n) {
    cell += window_.Step(direction);
    if (!window_.Inside(cell, 1)) return limit + 1;
    const float rise = checks_.RiseOver((n + 2) * checks_.StepLength(direction));
    if (!Meet(cell, z, rise).open) return n;
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
    if (footing.ground != kNoSurface) return footing.ground;
    if (!footing.IsFree()) return kNoSurface;
  }
  return kNoSurface;
}

std::uint32_t GroundChecks::Target(std::uint32_t i, int direction, int* cells) const {
  const std::uint32_t there = OneWayTarget(i, direction, cells);
  if (there == kNoSurface) return kNoSurface;
  int cells_back = 0;
  return OneWayTarget(there, direction ^ 4, &cells_back) == i ? there : kNoSurface;
}

// Sorts by cell and joins what overlaps and is of one kind.
void GroundChecks::IndexEdges(std::vector<GroundEdge> edges) {
  std::sort(edges.begin(), edges.end(), [](const GroundEdge& a, const GroundEdge& b) {
    return std::tie(a.cell, a.kind, a.z_low_m, a.z_high_m, a.value, a.seen_from_m) <
           std::tie(b.cell, b.kind, b.z_low_m, b.z_high_m, b.value, b.seen_from_m);
  });
  edge_first_.assign(static_cast<std::size_t>(window_.cell_count()) + 1, 0);
  for (const GroundEdge& edge : edges) {
    if (!edges_.empty() && edges_.back().cell == edge.cell && edges_.back().kind == edge.kind &&
        edge.z_low_m <= edges_.back().z_high_m) {
      edges_.back().z_high_m = std::max(edges_.back().z_high_m, edge.z_high_m);
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

const GroundEdge* GroundChecks::NearestEdge(int cell, float z, float within_m) const {
  for (std::size_t k = 0; k < disc_step_.size(); ++k) {
    if (checks_.disc[k].distance_m >= within_m) break;
    const int at = cell + disc_step_[k];
    for (std::uint32_t e = edge_first_[at]; e < edge_first_[at + 1]; ++e) {
      if (edges_[e].z_low_m <= z && z <= edges_[e].z_high_m) return &edges_[e];
    }
  }
  return nullptr;
}

float GroundChecks::EdgeDistance(int cell, float z) const {
  if (near_edge_[cell] == 0) return checks_.reach_m;
  for (std::size_t k = 0; k < disc_step_.size(); ++k) {
    const int at = cell + disc_step_[k];
    for (std::uint32_t e = edge_first_[at]; e < edge_first_[at + 1]; ++e) {
      if (edges_[e].z_low_m <= z && z <= edges_[e].z_high_m) return checks_.disc[k].distance_m;
    }
  }
  return checks_.reach_m;
}

// Over a gap no surface under the disc need have seen what stands within it.
bool GroundChecks::DiscIsFree(int cell, float z) const {
  for (std::size_t k = 0; k < disc_step_.size(); ++k) {
    const DiscCell& d = checks_.disc[k];
    if (d.distance_m >= checks_.footprint_m) break;
    const Footing footing = Meet(cell + disc_step_[k], z, d.level_m);
    if (footing.ground == kNoSurface && !footing.IsFree()) return false;
  }
  return true;
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
    if (EdgeDistance(cell, z) < checks_.footprint_m || !DiscIsFree(cell, z)) return false;
  }
  return true;
}

}  // namespace strata
