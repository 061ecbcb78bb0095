#include "core/planning/ground/ground_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/world/plan.h"
#include "core/world/things/inferred_tile.h"

namespace strata {
namespace {

constexpr int kReportedHoleCells = 64;

}  // namespace

GroundChecks::GroundChecks(const GroundWindow& window,
                           const ProfileChecks& checks,
                           Edges edges,
                           const ParallelLoop& loop)
    : window_(window), checks_(checks) {
  for (const DiscCell& d : checks.disc) {
    const int ring = std::max(std::abs(d.dx), std::abs(d.dy));
    while (static_cast<int>(ring_first_.size()) <= ring) ring_first_.push_back(disc_step_.size());
    disc_step_.push_back(d.dy * window.width() + d.dx);
  }
  ring_first_.push_back(disc_step_.size());
  // Cells this close to the window's border are not reached by any disc of the tile.
  const int rim = checks.sight_cells;
  const auto for_each_surface = [&](auto&& visit) {
    ForRows(loop, rim, window.width() - rim, [&](int band, int y) {
      const int row = y * window.width();
      const std::uint32_t end = window.begin(row + window.width() - rim);
      for (std::uint32_t i = window.begin(row + rim); i < end; ++i) visit(band, i);
    });
  };
  corners_count_ =
      static_cast<float>(std::hypot(0.5, 0.5) * checks.cell_size_m) < checks.footprint_m;
  ground_.assign(window.surface_count(), Ground::kEnds);
  std::vector<std::uint8_t> near(static_cast<std::size_t>(window.cell_count()), 0);
  for_each_surface([&](int /*band*/, std::uint32_t i) {
    ground_[i] = GroundAround(i);
    if (OnGround(i)) near[window.surface(i).cell] = 1;
  });
  if (edges == Edges::kOfGround) {
    // A surface's edges are up to the footprint away from it; over gaps, too, a disc looks at them.
    near = CellsFrom(near);
  } else {
    near.assign(near.size(), 0);
  }
  const int reach = checks.disc_cells + checks.behind_cells[0] + 1 + checks.gap_cells[0] + 1;
  std::array<std::vector<GroundEdge>, kRowBands> found;
  for_each_surface([&](int band, std::uint32_t i) {
    const WindowSurface& surface = window.surface(i);
    if (ground_[i] == Ground::kEven || surface.underside() || near[surface.cell] > reach) return;
    CollectEdges(i, &found[band]);
  });
  IndexEdges(found);
  std::vector<std::uint8_t> has_edge(near.size());
  for (std::size_t cell = 0; cell < has_edge.size(); ++cell) {
    has_edge[cell] = edge_first_[cell] != edge_first_[cell + 1] ? 1 : 0;
  }
  edge_cells_ = CellsFrom(has_edge);
}

// What CollectEdges() would find in the cells next to the surface, the cheap looks first.
GroundChecks::Ground GroundChecks::GroundAround(std::uint32_t i) const {
  const WindowSurface& surface = window_.surface(i);
  if (surface.underside() || Clearance(i) < checks_.height_m) return Ground::kEnds;
  if (MeetInferred(static_cast<int>(surface.cell), surface.z_m, checks_.step_m) != kNoSurface) {
    return Ground::kEnds;
  }
  unsigned holes = 0;
  bool even = true;
  for (int k = 0; k < 8; ++k) {
    const int cell = static_cast<int>(surface.cell) + window_.Step(k);
    const Footing footing = Meet(cell, surface.z_m, checks_.step_m);
    if (footing.ground != kNoSurface) continue;
    even = false;
    const bool counts = (k & 1) == 0 || corners_count_;
    if (counts && !footing.IsFree()) return Ground::kEnds;
    if (counts && footing.open) holes |= 1U << k;
  }
  for (int k = 0; k < 8; ++k) {
    if ((holes >> k & 1U) == 0) continue;
    const int cell = static_cast<int>(surface.cell) + window_.Step(k);
    if (!HoleIsTolerated(cell, surface.z_m)) return Ground::kEnds;
  }
  return even ? Ground::kEven : Ground::kBroken;
}

std::uint32_t GroundChecks::MeetInferred(int cell, float z, float rise_m) const {
  if (!window_.has_inferred()) return kNoSurface;
  for (std::uint32_t i = window_.begin_inferred(cell); i < window_.begin_inferred(cell + 1); ++i) {
    const InferredSpan& span = window_.inferred(i);
    if (span.low_m - z >= checks_.height_m) break;
    if (span.high_m - z > rise_m) return i;
  }
  return kNoSurface;
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
  if (const std::uint32_t span = MeetInferred(cell, z, checks_.step_m); span != kNoSurface) {
    CollectInferred(seen, span, edges);
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
  if (footing.inferred != kNoSurface) CollectInferred(seen, footing.inferred, edges);
}

void GroundChecks::CollectInferred(GroundEdge seen,
                                   std::uint32_t span,
                                   std::vector<GroundEdge>* edges) const {
  const float z = seen.seen_from_m;
  const InferredSpan& met = window_.inferred(span);
  const bool hangs = met.low_m - z > checks_.step_m;
  seen.kind = hangs ? Obstruction::kClearance : Obstruction::kObstacle;
  seen.value = hangs ? met.low_m - z : met.high_m - z;
  seen.inferred = true;
  // No surface of its own sees it from other levels.
  seen.z_low_m = std::max(seen.z_low_m, met.low_m - checks_.height_m);
  seen.z_high_m = std::min(seen.z_high_m, met.high_m - checks_.step_m);
  edges->push_back(seen);
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

// Sorts by cell and joins what overlaps and is of one kind; what was measured comes first.
void GroundChecks::IndexEdges(const std::array<std::vector<GroundEdge>, kRowBands>& found) {
  std::vector<std::uint32_t> begin(static_cast<std::size_t>(window_.cell_count()) + 1, 0);
  for (const std::vector<GroundEdge>& edges : found) {
    for (const GroundEdge& edge : edges) ++begin[edge.cell + 1];
  }
  for (int cell = 0; cell < window_.cell_count(); ++cell) begin[cell + 1] += begin[cell];
  std::vector<GroundEdge> sorted(begin.back());
  std::vector<std::uint32_t> next = begin;
  for (const std::vector<GroundEdge>& edges : found) {
    for (const GroundEdge& edge : edges) sorted[next[edge.cell]++] = edge;
  }
  edge_first_.assign(begin.size(), 0);
  for (int cell = 0; cell < window_.cell_count(); ++cell) {
    const auto first = sorted.begin() + begin[cell];
    const auto last = sorted.begin() + begin[cell + 1];
    std::sort(first, last, [](const GroundEdge& a, const GroundEdge& b) {
      return std::tie(a.inferred, a.kind, a.z_low_m, a.z_high_m, a.value, a.seen_from_m) <
             std::tie(b.inferred, b.kind, b.z_low_m, b.z_high_m, b.value, b.seen_from_m);
    });
    for (auto edge = first; edge != last; ++edge) {
      const bool joins = edges_.size() > edge_first_[cell] && edges_.back().kind == edge->kind &&
                         edges_.back().inferred == edge->inferred &&
                         edge->z_low_m <= edges_.back().z_high_m;
      if (joins) {
        edges_.back().z_high_m = std::max(edges_.back().z_high_m, edge->z_high_m);
      } else {
        edges_.push_back(*edge);
      }
    }
    edge_first_[cell + 1] = static_cast<std::uint32_t>(edges_.size());
  }
}

std::vector<std::uint8_t> GroundChecks::CellsFrom(const std::vector<std::uint8_t>& marked) const {
  const int width = window_.width();
  std::vector<std::uint8_t> cells(marked.size(), kFarCells);
  const auto from = [&](int x, int y) {
    return x < 0 || y < 0 || x >= width || y >= width ? int{kFarCells} : cells[y * width + x];
  };
  for (int y = 0; y < width; ++y) {
    for (int x = 0; x < width; ++x) {
      const int least =
          std::min({from(x - 1, y), from(x - 1, y - 1), from(x, y - 1), from(x + 1, y - 1)});
      const int cell = y * width + x;
      cells[cell] =
          marked[cell] != 0 ? 0 : static_cast<std::uint8_t>(std::min(least + 1, +kFarCells));
    }
  }
  for (int y = width - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      const int least =
          std::min({from(x + 1, y), from(x + 1, y + 1), from(x, y + 1), from(x - 1, y + 1)});
      std::uint8_t& cell = cells[y * width + x];
      cell = static_cast<std::uint8_t>(std::min<int>(cell, least + 1));
    }
  }
  return cells;
}

const GroundEdge* GroundChecks::NearestEdge(int cell, float z, float within_m) const {
  for (std::size_t k = FirstOfRing(edge_cells_[cell]); k < disc_step_.size(); ++k) {
    if (checks_.disc[k].distance_m >= within_m) break;
    const int at = cell + disc_step_[k];
    for (std::uint32_t e = edge_first_[at]; e < edge_first_[at + 1]; ++e) {
      if (edges_[e].z_low_m <= z && z <= edges_[e].z_high_m) return &edges_[e];
    }
  }
  return nullptr;
}

float GroundChecks::EdgeDistance(int cell, float z) const {
  for (std::size_t k = FirstOfRing(edge_cells_[cell]); k < disc_step_.size(); ++k) {
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
