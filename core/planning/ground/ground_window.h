// The surfaces of one tile and of a margin of its neighbours in one dense grid, so that checks near
// a tile's border see exactly what they see inside.
#ifndef STRATA_CORE_PLANNING_GROUND_GROUND_WINDOW_H_
#define STRATA_CORE_PLANNING_GROUND_GROUND_WINDOW_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/mls/local_plane.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/world/things/inferred_tile.h"

namespace strata {

// A tile in the middle (index 4) and its eight neighbours of the same level of detail, row by row
// from the lower left; nullptr where the map has nothing.
using TileNeighbourhood = std::array<std::shared_ptr<const SurfaceTile>, 9>;
inline constexpr int kMiddleTile = 4;
// What was inferred in the same tiles; nullptr where that is nothing.
using InferredNeighbourhood = std::array<std::shared_ptr<const InferredTile>, 9>;

// The eight directions of a move, counter-clockwise from east; the opposite of k is k ^ 4.
inline constexpr std::array<int, 8> kStepX = {1, 1, 0, -1, -1, -1, 0, 1};
inline constexpr std::array<int, 8> kStepY = {0, 1, 1, 1, 0, -1, -1, -1};

struct WindowSurface : HeightSample {
  std::uint32_t cell = 0;  // of the window
};

// Cells are numbered y · width + x from the lower left corner of the margin. Immutable.
class GroundWindow {
 public:
  // REQUIRES: 0 ≤ margin ≤ kTileCells; tiles[kMiddleTile] is not nullptr.
  GroundWindow(const TileNeighbourhood& tiles,
               int margin,
               double cell_size_m,
               const InferredNeighbourhood& inferred = {});

  double cell_size_m() const { return cell_size_m_; }
  int margin() const { return margin_; }
  int width() const { return width_; }
  int cell_count() const { return width_ * width_; }
  int Step(int direction) const { return kStepY[direction] * width_ + kStepX[direction]; }

  // Surfaces of cell c, lowest first, are numbers [begin(c), begin(c + 1)).
  std::uint32_t begin(int cell) const { return first_[cell]; }
  const WindowSurface& surface(std::uint32_t i) const { return surfaces_[i]; }
  std::uint32_t surface_count() const { return static_cast<std::uint32_t>(surfaces_.size()); }

  // Of what was inferred in cell c, lowest first: numbers [begin_inferred(c), begin_inferred(c +
  // 1)). REQUIRES: has_inferred(), which is false where that is nothing in the whole window.
  bool has_inferred() const { return !inferred_.empty(); }
  std::uint32_t begin_inferred(int cell) const { return first_inferred_[cell]; }
  const InferredSpan& inferred(std::uint32_t i) const { return inferred_[i]; }

  // True if a deck within kMaxUnseenDeckM of height z goes on in the cell though no beam hit it
  // there, over a floor that others saw (DeckGoesOn). Its underside is marked as one.
  bool DeckIsUnseen(int cell, float z) const {
    constexpr auto kReach = static_cast<float>(kMaxUnseenDeckM);
    if (unseen_decks_.empty()) return false;
    const auto number = static_cast<std::uint32_t>(cell);
    const auto deck =
        std::lower_bound(unseen_decks_.begin(), unseen_decks_.end(), std::pair(number, z - kReach));
    return deck != unseen_decks_.end() && deck->first == number && deck->second <= z + kReach;
  }

  int CellOfTile(std::uint16_t cell_in_tile) const {
    return ((cell_in_tile >> kTileShift) + margin_) * width_ + (cell_in_tile & (kTileCells - 1)) +
           margin_;
  }
  // True if the cell is at least `depth` cells inside the window.
  bool Inside(int cell, int depth) const {
    const int x = cell % width_;
    const int y = cell / width_;
    return x >= depth && y >= depth && x < width_ - depth && y < width_ - depth;
  }

 private:
  void AppendRow(const TileNeighbourhood& tiles, int y);
  void AppendInferredRow(const InferredNeighbourhood& tiles, int y);
  void FindUnseenDecks();

  double cell_size_m_;
  int margin_;
  int width_;
  std::vector<WindowSurface> surfaces_;
  std::vector<std::uint32_t> first_;
  std::vector<InferredSpan> inferred_;  // InferredSpan::cell is not that of the window
  std::vector<std::uint32_t> first_inferred_;
  std::vector<std::pair<std::uint32_t, float>> unseen_decks_;  // cell, height; in order
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_GROUND_GROUND_WINDOW_H_
