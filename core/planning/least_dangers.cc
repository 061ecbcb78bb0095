#include "core/planning/least_dangers.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/move_cost.h"
#include "core/planning/patch_index.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

// kClosedBlock where nobody can stand; however dangerous it is, nothing else is closed.
std::uint16_t LeastIn(const PreparedTile& tile, std::uint32_t block) {
  const std::uint32_t begin = tile.standing.FirstOf(block);
  const std::uint32_t end = tile.standing.FirstOf(block + 1);
  std::uint16_t least = begin == end ? kClosedBlock : kClosedBlock - 1;
  for (std::uint32_t i = begin; i < end; ++i) least = std::min(least, tile.patches[i].danger);
  return least;
}

// A move over a gap may be cheaper than one between patches as dangerous as one of its ends.
void LowerAlong(LeastDangers& least, std::uint16_t cell, int direction, int cells) {
  int x = cell & (kTileCells - 1);
  int y = cell >> kTileShift;
  for (int n = 0; n <= cells; ++n, x += kStepX[direction], y += kStepY[direction]) {
    if (x < 0 || y < 0 || x >= kTileCells || y >= kTileCells) return;
    const auto passed = static_cast<std::uint16_t>(y << kTileShift | x);
    std::uint16_t& known = least[PatchIndex::FirstSheetPlace(passed) / 64];
    known = std::min(known, LeastGapDanger());
  }
}

}  // namespace

std::uint16_t LeastGapDanger() {
  static const std::uint16_t code = DangerCode(kGapDanger / 2.0);
  return code;
}

LeastDangers LeastDangersOf(const PreparedTile& tile) {
  LeastDangers least;
  for (std::uint32_t block = 0; block < PatchIndex::kBlocks; ++block) {
    least[block] = LeastIn(tile, block);
  }
  tile.standing.ForEach([&](std::uint32_t place, std::uint32_t number) {
    if (tile.standing.HasAllAround(place)) return;
    const std::uint32_t below = tile.standing.OnFirstSheet(place);
    for (unsigned left = tile.patches[number].moves; left != 0; left &= left - 1) {
      const int k = std::countr_zero(left);
      if (tile.standing.Has(PatchIndex::Beside(below, k))) continue;
      int cells = 0;
      tile.Target(place, number, k, &cells);
      if (cells > 1) LowerAlong(least, tile.standing.CellOf(place), k, cells);
    }
  });
  for (const FarMove& move : tile.far_moves) {
    if (move.cells == 1) continue;
    LowerAlong(least, tile.standing.CellOf(move.place), move.direction, move.cells);
  }
  return least;
}

}  // namespace strata
