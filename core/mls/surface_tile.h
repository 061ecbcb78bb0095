// What readers of a map see: surfaces without the statistics behind them. Planners, pictures and
// clients use these.
#ifndef STRATA_CORE_MLS_SURFACE_TILE_H_
#define STRATA_CORE_MLS_SURFACE_TILE_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/mls/mls_map.h"
#include "core/mls/tile_key.h"

namespace strata {

// What a patch's top is for a robot (thesis 6.5.4, 6.5.5): kUnknown before annotation. Of a
// kUnderside (Patch::underside) the top was not seen: no ground for anybody.
enum class Traversability : std::uint8_t {  // stored in tiles
  kUnknown = 0,
  kTraversable = 1,
  kNonTraversable = 2,
  kUnderside = 3,
};

// One patch as served, 24 bytes.
struct Surface {
  std::uint16_t cell = 0;  // CellInTile
  Traversability traversability = Traversability::kUnknown;
  std::uint8_t class_id = 0;    // class with the most votes, the smaller id on a tie; 0 = none
  std::uint8_t confidence = 0;  // share of the votes that class_id has [%], 1 to 100; 0 without
  Colour colour = {};           // mean of its points'; all 0 = none known, black is (1, 1, 1)
  float z_m = 0.0F;             // Patch::mean_m()
  float sigma_m = 0.0F;         // Patch::sigma_m()
  float depth_m = 0.0F;         // Patch::depth_m(); > 0 means vertical
  float cost = 0.0F;  // path cost factor of the default profile, ≥ 0 (6.2.2); see traversability.h

  bool vertical() const { return depth_m > 0.0F; }
  bool coloured() const { return colour != Colour(); }
  bool underside() const { return traversability == Traversability::kUnderside; }
  // Underside of what stands below this surface.
  float bottom_m() const { return z_m - depth_m; }

  friend bool operator==(const Surface&, const Surface&) = default;
};
static_assert(sizeof(Surface) == 24);

// A known colour as Surface::colour has it.
inline Colour Known(const Colour& colour) {
  return colour == Colour() ? Colour{.r = 1, .g = 1, .b = 1} : colour;
}
// The same of what was summed; all 0 where that is nothing.
Colour MeanColour(const ColourSum& sum);

// Surfaces sorted by (cell, z).
struct SurfaceTile {
  TileKey key;
  // Commit sequence of the content; a tile with the same key and version has the same bytes.
  std::uint64_t version = 0;
  std::vector<Surface> surfaces;
  std::array<std::uint32_t, kTileCells + 1> row_begin{};

  void IndexRows();
  std::span<const Surface> Cell(std::uint16_t cell_in_tile) const;

  friend bool operator==(const SurfaceTile&, const SurfaceTile&) = default;
};

// The surfaces of a tile, not annotated: traversability kUnknown or kUnderside, cost 0. Votes for
// classes beyond what class_id holds are not counted.
SurfaceTile SurfacesOf(const MlsTile& tile);

}  // namespace strata

#endif  // STRATA_CORE_MLS_SURFACE_TILE_H_
