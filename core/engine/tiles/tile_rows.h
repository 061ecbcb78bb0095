// How tiles are written, by whoever changes them: encoded first, by the thread that made them, for
// acknowledgements wait while a transaction is open.
#ifndef STRATA_CORE_ENGINE_TILES_TILE_ROWS_H_
#define STRATA_CORE_ENGINE_TILES_TILE_ROWS_H_

#include <cstdint>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

// What rows stand in for.
struct TileRowKeys {
  absl::btree_set<TileKey> tiles;
  absl::btree_set<TileKey> gone;  // tiles in which there is nothing any more; no row has been put
  absl::btree_set<TileKey> surfaces;

  void Add(const MlsTileMap& changed, const std::vector<SurfaceTileRow>& rows);
};

// Rows for the tiles of `changed` that are not gone. Errors of EncodeMlsTile.
absl::StatusOr<std::vector<MlsTileRow>> EncodeTileRows(const MlsTileMap& changed,
                                                       std::uint64_t version,
                                                       double cell_size_m);

// Beside the current rows; nobody sees them until they are published.
absl::Status PutTileRows(StorageWriter& writer,
                         const std::vector<MlsTileRow>& tiles,
                         const std::vector<SurfaceTileRow>& surfaces);

// Drops what rows of `version` stand in for, once nobody who reads at `floor` or later sees it. In
// the transaction that publishes them; before or after they are put.
absl::Status RetireTileRows(StorageWriter& writer,
                            const TileRowKeys& keys,
                            std::uint64_t version,
                            std::uint64_t floor);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_TILE_ROWS_H_
