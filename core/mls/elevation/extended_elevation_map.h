// Extended elevation maps: one height a cell, chosen so that underpasses stay open (thesis 6.4).
#ifndef STRATA_CORE_MLS_ELEVATION_EXTENDED_ELEVATION_MAP_H_
#define STRATA_CORE_MLS_ELEVATION_EXTENDED_ELEVATION_MAP_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/mls/traversability.h"

namespace strata {

// The four classes of 6.4.2.
enum class ElevationClass : std::uint8_t {
  kTraversable = 1,  // horizontal, and planar enough
  // Horizontal; too steep, rough or stepped, seen from below only, or too little around to tell.
  // Also several intervals with room for the robot between two of them of which none is
  // traversable.
  kNonTraversable = 2,
  kVertical = 3,  // one interval taller than τ, or several without room for the robot between
  kGap = 4,       // several intervals with room for the robot between two of them
};

struct ExtendedElevationCell {
  std::uint16_t cell = 0;  // CellInTile
  ElevationClass elevation_class = ElevationClass::kVertical;
  // The cell's one height: the surface of its interval; of a gap cell the minimum traversable
  // elevation, which is the lowest surface with room for the robot above that can be driven on
  // among those of all levels around; where none can, the lowest with room; of vertical cells the
  // highest.
  float z_m = 0.0F;
  float sigma_m = 0.0F;
  // How far below z the cell is filled: the interval's length, of a vertical cell down to the
  // lowest measurement, 0 of a horizontal one.
  float depth_m = 0.0F;

  // Whether a robot may be on it.
  bool passable() const {
    return elevation_class == ElevationClass::kTraversable ||
           elevation_class == ElevationClass::kGap;
  }
  friend bool operator==(const ExtendedElevationCell&, const ExtendedElevationCell&) = default;
};

// Occupied cells of one tile, sorted by cell.
struct ExtendedElevationTile {
  TileKey key;
  std::vector<ExtendedElevationCell> cells;

  // nullptr where nothing was measured.
  const ExtendedElevationCell* Find(std::uint16_t cell_in_tile) const;
};

struct ExtendedElevationMap {
  std::vector<ExtendedElevationTile> tiles;  // sorted by key

  const ExtendedElevationCell* Find(CellIndex cell) const;
};

// The extended elevation map of the surfaces of tiles: the height intervals of 6.4.2 are those of
// the multi-level surface map (same cells, γ and τ), of which one height a cell is kept. Room for
// the robot is limits.clearance_m. Gap cells are judged by AssessSurfaces over the surfaces of all
// levels; planarity of cells of one interval over the one height a cell, so that one next to a
// wall, or next to a gap cell below it, has a step beside it. What was seen from below only is no
// ground. Tiles have one level of detail and cells of `cell_size_m`; their traversability is found
// anew. CANCELLED and DEADLINE_EXCEEDED.
absl::StatusOr<ExtendedElevationMap> MakeExtendedElevationMap(std::vector<SurfaceTile> tiles,
                                                              double cell_size_m,
                                                              const TraversabilityLimits& limits,
                                                              const Stop& stop = Stop());

// Its heights with their σ. OUT_OF_RANGE as RectangleAround.
absl::StatusOr<ElevationMap> ElevationOf(const ExtendedElevationMap& map,
                                         double cell_size_m,
                                         const ElevationRegion& region = kEverywhere);

}  // namespace strata

#endif  // STRATA_CORE_MLS_ELEVATION_EXTENDED_ELEVATION_MAP_H_
