// One tile as one robot profile sees it: which surfaces it may stand on and what every move costs.
#ifndef STRATA_CORE_PLANNING_PREPARED_TILE_H_
#define STRATA_CORE_PLANNING_PREPARED_TILE_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground_window.h"
#include "core/planning/profile_checks.h"
#include "core/planning/rows.h"

namespace strata {

// Costs are whole numbers: a move of one cell over ground without danger costs kCostPerCell.
inline constexpr std::uint32_t kCostPerCell = 2048;
inline constexpr std::uint32_t kCostPerDiagonal = 2896;  // ⌊2048 √2⌋

// A move in one of the eight directions, over a gap too: target = own number + delta, in the same
// tile.
struct Move {
  std::int16_t delta = 0;
  std::uint16_t cost = kNone;

  static constexpr std::uint16_t kNone = 0;      // no such move
  static constexpr std::uint16_t kFar = 0xFFFF;  // see PreparedTile::far_moves

  friend bool operator==(const Move&, const Move&) = default;
};

// A move into another tile, or one that does not fit into a Move.
struct FarMove {
  std::uint32_t patch = 0;  // from
  std::uint8_t direction = 0;
  std::uint8_t level = 0;   // of the target among the surfaces of its cell, 0 = lowest
  std::uint16_t cells = 0;  // length; > 1: over a gap
  std::uint32_t cost = 0;

  friend bool operator==(const FarMove&, const FarMove&) = default;
};

// Patches are numbered along a Morton curve over the tile's cells, lowest first within a cell, so
// that what a search touches together lies together. 45 bytes a patch, 46 with classes. Immutable.
struct PreparedTile {
  TileKey key;
  std::vector<std::array<Move, 8>> moves;
  std::vector<FarMove> far_moves;   // by (patch, direction)
  std::vector<std::uint16_t> cell;  // CellInTile
  std::vector<float> z_m;
  std::vector<float> danger;  // < 0: the robot cannot stand there
  // ⌊255 · EdgeDistance / reach⌋; 0 where an edge next to the surface keeps the robot away.
  std::vector<std::uint8_t> edge_distance;
  std::vector<std::uint8_t> class_id;             // empty where no surface has a class
  std::array<std::uint32_t, 1025> block_begin{};  // first patch of each 8 × 8 block of cells

  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFFU;

  std::uint32_t size() const { return static_cast<std::uint32_t>(cell.size()); }
  bool CanStand(std::uint32_t patch) const { return danger[patch] >= 0.0F; }
  std::uint8_t ClassOf(std::uint32_t patch) const { return class_id.empty() ? 0 : class_id[patch]; }
  // Patches of a cell: [first, first + count).
  void FindCell(std::uint16_t cell_in_tile, std::uint32_t* first, std::uint32_t* count) const;
  const FarMove& Far(std::uint32_t patch, int direction) const;
  std::size_t memory_bytes() const;

  friend bool operator==(const PreparedTile&, const PreparedTile&) = default;
};

// Cost of a move of `run_m` sideways and `rise_m` up or down between patches of two dangers.
// kGapDanger comes on top over unobserved ground.
inline constexpr double kGapDanger = 1.0;
inline std::uint32_t MoveCost(double run_m, double rise_m, double danger, double cell_size_m) {
  const double length_cells = std::sqrt(run_m * run_m + rise_m * rise_m) / cell_size_m;
  const double cost = kCostPerCell * length_cells * (1.0 + danger);
  // To nearest, and never below what the search's heuristic takes for the same stretch.
  return static_cast<std::uint32_t>(
      std::min(cost + 0.5, static_cast<double>(std::numeric_limits<std::int32_t>::max())));
}

// REQUIRES: window.margin() == checks.margin. The same with any `loop`.
PreparedTile PrepareTile(const TileKey& key,
                         const GroundWindow& window,
                         const ProfileChecks& checks,
                         const ParallelLoop& loop = {});

// The class of each patch of `tile`, which was prepared from `surfaces`; empty if none has one.
std::vector<std::uint8_t> ClassesOf(const PreparedTile& tile, const SurfaceTile& surfaces);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PREPARED_TILE_H_
