// Worlds drawn as rows of characters, for whoever needs surfaces at places that can be seen in the
// test.
#ifndef STRATA_TESTS_SUPPORT_DRAWING_H_
#define STRATA_TESTS_SUPPORT_DRAWING_H_

#include <map>
#include <vector>

#include "absl/strings/string_view.h"

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata::testing {

// One surface of a column: its top, and how far down it reaches (> 0: vertical).
struct DrawnSurface {
  double z_m = 0.0;
  double depth_m = 0.0;
  double sigma_m = 0.01;
  bool underside = false;
};

// Columns of cells, edited by hand and cut into tiles.
class DrawnMap {
 public:
  std::vector<DrawnSurface>& operator[](CellIndex cell) { return columns_[cell]; }
  void Erase(CellIndex cell) { columns_.erase(cell); }
  const std::map<CellIndex, std::vector<DrawnSurface>>& columns() const { return columns_; }
  // Surfaces sorted and rows indexed, tiles by key, all of version `version`.
  std::vector<SurfaceTile> Tiles(std::uint64_t version = 1) const;

 private:
  std::map<CellIndex, std::vector<DrawnSurface>> columns_;
};

// What a character stands for; characters that are not in it leave their cells empty.
using Legend = std::map<char, std::vector<DrawnSurface>>;

// Draws a row a line, the top line farthest north; blank lines are skipped. Each character fills
// `scale` × `scale` cells; the lower left one begins at `lower_left`.
DrawnMap MapFromDrawing(absl::string_view rows,
                        const Legend& legend,
                        int scale = 1,
                        CellIndex lower_left = {0, 0});

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_DRAWING_H_
