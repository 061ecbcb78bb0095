// One tile as one robot profile sees it: which surfaces it may stand on, and all that moves cost.
#ifndef STRATA_CORE_PLANNING_PREPARED_TILE_H_
#define STRATA_CORE_PLANNING_PREPARED_TILE_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/planning/move_cost.h"
#include "core/planning/patch_index.h"

namespace strata {

// A place to stand.
struct PreparedPatch {
  // Directions, a bit each, in which the robot may move to the next cell of the tile with patches,
  // over a gap if need be: to the one of them that is nearest in height.
  std::uint8_t moves = 0;
  // ⌊255 · EdgeDistance / reach⌋.
  std::uint8_t edge_distance = 0;
  std::uint16_t height = 0;  // steps above PreparedTile::base_steps
  std::uint16_t danger = 0;  // DangerCode()

  friend bool operator==(const PreparedPatch&, const PreparedPatch&) = default;
};

// Dangers d ∈ [0, 255) are kept to 1/16,000 of 1 + d: that with 13 bits behind the point.
std::uint16_t DangerCode(double danger);
inline float OnePlusDanger(std::uint16_t code) {
  return std::bit_cast<float>(0x3F800000U + (std::uint32_t{code} << 10));
}

// Any other move: into another tile, or not to the patch nearest in height.
struct FarMove {
  std::uint32_t place = 0;  // from
  std::uint8_t direction = 0;
  std::uint8_t level = 0;   // of the target among the patches of its cell, 0 = lowest
  std::uint16_t cells = 0;  // length; > 1: over a gap
  std::uint32_t cost = 0;

  friend bool operator==(const FarMove&, const FarMove&) = default;
};

// Six bytes a patch, one more with classes, two a surface where the robot cannot stand, and the
// indices of both. Immutable. Places of `standing` are followed by those of `other`.
struct PreparedTile {
  TileKey key;
  PatchIndex standing;
  std::vector<PreparedPatch> patches;     // of `standing`, by number
  std::vector<std::uint8_t> class_id;     // of `standing`; empty where no surface has a class
  std::vector<FarMove> far_moves;         // by (place, direction)
  std::vector<std::uint64_t> far_places;  // sheets of `standing`: who has any
  PatchIndex other;                       // surfaces where the robot cannot stand
  std::vector<std::uint16_t> other_heights;
  std::int32_t base_steps = 0;
  // Heights of `standing`, then of `other`, where one is no whole step or they are more than 128 m
  // apart; else empty. Then the others are 0.
  std::vector<float> exact_heights;

  std::uint32_t places() const { return standing.places() + other.places(); }
  bool CanStand(std::uint32_t place) const { return standing.Has(place); }
  bool HasSurface(std::uint32_t place) const {
    return CanStand(place) || (place >= standing.places() && other.Has(place - standing.places()));
  }
  // REQUIRES: HasSurface(place).
  float Height(std::uint32_t place) const;
  float HeightOf(std::uint32_t number) const {
    if (!exact_heights.empty()) return exact_heights[number];
    return static_cast<float>(base_steps + patches[number].height) / kHeightStepsPerM;
  }
  std::uint8_t ClassOf(std::uint32_t number) const {
    return class_id.empty() ? 0 : class_id[number];
  }
  // REQUIRES: place < places().
  std::uint16_t CellOf(std::uint32_t place) const {
    return place < standing.places() ? standing.CellOf(place)
                                     : other.CellOf(place - standing.places());
  }
  // Where a move of PreparedPatch::moves leads, and how many cells far that is.
  [[gnu::always_inline]] std::uint32_t Target(std::uint32_t place,
                                              std::uint32_t number,
                                              int direction,
                                              int* cells) const {
    *cells = 1;
    const std::uint32_t beside = PatchIndex::Beside(standing.OnFirstSheet(place), direction);
    if (standing.HasOne(beside)) return beside;
    return FarTarget(place, number, direction, cells);
  }
  // What it costs, between patches of these numbers.
  [[gnu::always_inline]] std::uint32_t Cost(const StepCosts& costs,
                                            std::uint32_t from,
                                            std::uint32_t to,
                                            int direction,
                                            int cells) const {
    const PreparedPatch& a = patches[from];
    const PreparedPatch& b = patches[to];
    const double dangers = static_cast<double>(OnePlusDanger(a.danger)) + OnePlusDanger(b.danger);
    const auto rise = static_cast<std::uint32_t>(std::abs(int{a.height} - int{b.height}));
    if (cells == 1 && exact_heights.empty()) return costs.OfSteps(direction, rise, dangers);
    return costs.OfRise(direction, cells, HeightOf(from) - HeightOf(to), dangers);
  }
  bool HasFarMoves(std::uint32_t place) const {
    return (far_places[place / 64] >> (place % 64) & 1U) != 0;
  }
  // In far_moves, where those of a place begin.
  std::size_t FirstFarMove(std::uint32_t place) const;
  // nullptr if there is none.
  const FarMove* Far(std::uint32_t place, int direction) const;

  std::size_t memory_bytes() const;

  friend bool operator==(const PreparedTile&, const PreparedTile&) = default;

 private:
  std::uint32_t FarTarget(std::uint32_t place,
                          std::uint32_t number,
                          int direction,
                          int* cells) const;
};

// Fills far_places from far_moves.
void IndexFarMoves(PreparedTile& tile);

// `surfaces` is the tile that the window was made around. REQUIRES: window.margin() ==
// checks.margin. The same with any `loop`.
PreparedTile PrepareTile(const SurfaceTile& surfaces,
                         const GroundWindow& window,
                         const ProfileChecks& checks,
                         const ParallelLoop& loop = {});

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_PREPARED_TILE_H_
