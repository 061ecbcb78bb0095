#include "core/planning/ground/ground_window.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

#include "core/mls/local_plane.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {

GroundWindow::GroundWindow(const TileNeighbourhood& tiles,
                           int margin,
                           double cell_size_m,
                           const InferredNeighbourhood& inferred)
    : cell_size_m_(cell_size_m), margin_(margin), width_(kTileCells + 2 * margin) {
  surfaces_.reserve(tiles[kMiddleTile]->surfaces.size() * 5 / 4);
  first_.assign(static_cast<std::size_t>(cell_count()) + 1, 0);
  for (int y = 0; y < width_; ++y) AppendRow(tiles, y);
  // first_[c + 1] holds the count of cell c so far.
  for (int cell = 0; cell < cell_count(); ++cell) first_[cell + 1] += first_[cell];
  FindUnseenDecks();
  if (std::all_of(inferred.begin(), inferred.end(), [](const auto& tile) { return !tile; })) return;
  first_inferred_.assign(first_.size(), 0);
  for (int y = 0; y < width_; ++y) AppendInferredRow(inferred, y);
  for (int cell = 0; cell < cell_count(); ++cell) {
    first_inferred_[cell + 1] += first_inferred_[cell];
  }
}

// Every one has a top of its deck to the west or to the south. What lies below it as a deck is
// thick, and over a floor, is its underside; the ground between two posts is not.
void GroundWindow::FindUnseenDecks() {
  const auto column = [this](int cell) {
    return std::span<const WindowSurface>(surfaces_.data() + first_[cell],
                                          surfaces_.data() + first_[cell + 1]);
  };
  const auto look = [&](const WindowSurface& top, int step) {
    for (int n = 1; n <= kMaxUnseenDeckCells; ++n) {
      const int cell = static_cast<int>(top.cell) + n * step;
      if (!Inside(cell, kMaxUnseenDeckCells)) return;
      const bool goes_on = DeckGoesOn(
          top.z_m, cell_size_m_, [&](int dx, int dy) { return column(cell + dy * width_ + dx); });
      if (!goes_on) return;
      if (!column(cell).empty()) unseen_decks_.emplace_back(cell, top.z_m);
    }
  };
  float lowest_m = std::numeric_limits<float>::infinity();
  for (const WindowSurface& surface : surfaces_) lowest_m = std::min(lowest_m, surface.z_m);
  for (const WindowSurface& top : surfaces_) {
    if (top.underside() || top.z_m - lowest_m < kLeastUnseenDropM) continue;
    look(top, 1);
    look(top, width_);
  }
  std::sort(unseen_decks_.begin(), unseen_decks_.end());
  for (const auto& [cell, z_m] : unseen_decks_) {
    for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
      const float below_m = z_m - surfaces_[i].z_m;
      const bool over_floor = surfaces_[first_[cell]].z_m < surfaces_[i].z_m - kMaxDeckM;
      if (over_floor && below_m >= kLeastUnseenDropM && below_m <= kMaxDeckM) {
        surfaces_[i].weight = 0.0F;
      }
    }
  }
}

void GroundWindow::AppendInferredRow(const InferredNeighbourhood& tiles, int y) {
  const int tile_row = (y - margin_) >> kTileShift;  // -1, 0 or 1
  const auto row = static_cast<std::uint32_t>((y - margin_) & (kTileCells - 1));
  for (int tile_column = -1; tile_column <= 1; ++tile_column) {
    const InferredTile* tile = tiles[(tile_row + 1) * 3 + tile_column + 1].get();
    if (tile == nullptr) continue;
    const int offset = tile_column * kTileCells + margin_;
    for (const InferredSpan& span : tile->Cells(row << kTileShift, (row + 1) << kTileShift)) {
      const int x = (span.cell & (kTileCells - 1)) + offset;
      if (x < 0 || x >= width_) continue;
      inferred_.push_back(span);
      ++first_inferred_[y * width_ + x + 1];
    }
  }
}

void GroundWindow::AppendRow(const TileNeighbourhood& tiles, int y) {
  const int tile_row = (y - margin_) >> kTileShift;  // -1, 0 or 1
  const int row = (y - margin_) & (kTileCells - 1);
  for (int tile_column = -1; tile_column <= 1; ++tile_column) {
    const SurfaceTile* tile = tiles[(tile_row + 1) * 3 + tile_column + 1].get();
    if (tile == nullptr) continue;
    const int offset = tile_column * kTileCells + margin_;
    for (std::uint32_t i = tile->row_begin[row]; i < tile->row_begin[row + 1]; ++i) {
      const Surface& surface = tile->surfaces[i];
      const int x = (surface.cell & (kTileCells - 1)) + offset;
      if (x < 0 || x >= width_) continue;
      const int cell = y * width_ + x;
      surfaces_.push_back({SampleOf(surface, cell_size_m_), static_cast<std::uint32_t>(cell)});
      ++first_[cell + 1];
    }
  }
}

}  // namespace strata
