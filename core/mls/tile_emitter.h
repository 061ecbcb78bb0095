// Turns the measurements of a scan, sorted by cell, into tiles of patches and annotation layers.
// The last step of build.h.
#ifndef STRATA_CORE_MLS_TILE_EMITTER_H_
#define STRATA_CORE_MLS_TILE_EMITTER_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/mls/measurement.h"
#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

// Working memory; holds no state between calls.
struct EmitScratch {
  std::vector<std::uint32_t> starts;  // where cells begin
  std::vector<Patch> patches;         // of one tile
  std::vector<std::uint16_t> labels;  // of one patch
};

// Appends the tiles of `items` to `tiles`, by rising key. `items` are sorted by CellOfKey, in any
// order within a cell, which may change; the tile bytes of their keys count from `corner`. Item is
// Measurement, or IndexedMeasurement for a cloud with columns.
template <typename Item>
void EmitTiles(std::span<Item> items,
               TileKey corner,
               const PointCloud& cloud,
               const MlsParameters& parameters,
               EmitScratch& scratch,
               std::vector<MlsTile>& tiles);

}  // namespace strata

#endif  // STRATA_CORE_MLS_TILE_EMITTER_H_
