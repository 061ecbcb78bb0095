#include "core/planning/ground/ground_window.h"

#include <algorithm>
#include <cstdint>

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
  if (std::all_of(inferred.begin(), inferred.end(), [](const auto& tile) { return !tile; })) return;
  first_inferred_.assign(first_.size(), 0);
  for (int y = 0; y < width_; ++y) AppendInferredRow(inferred, y);
  for (int cell = 0; cell < cell_count(); ++cell) {
    first_inferred_[cell + 1] += first_inferred_[cell];
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
