// Tiles that are written beside the current ones, in small commits, and switched to at once.
#ifndef STRATA_CORE_ENGINE_TILES_STAGED_TILES_H_
#define STRATA_CORE_ENGINE_TILES_STAGED_TILES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

#include "core/engine/map/map_core.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/engine/tiles/tile_rows.h"

namespace strata {

// One thread at a time. What is not published is discarded with it; where the store fails, before
// the next version is made, or by the next start.
class StagedTiles {
 public:
  // `version`: of all rows; from Integrator::NextVersion().
  StagedTiles(MapCore& core, std::uint64_t version) : core_(core), version_(version) {
    core_.set_tiles_staged(true);
  }
  ~StagedTiles();
  StagedTiles(const StagedTiles&) = delete;
  StagedTiles& operator=(const StagedTiles&) = delete;

  absl::Status Put(const MlsTileMap& tiles, const SurfaceTileMaker::Rows& surfaces);
  // The same of tiles that are encoded, whatever their version says.
  absl::Status PutRows(std::vector<MlsTileRow> rows);

  // Makes all of it what readers see, together with what `decision` writes; watchers learn of it
  // and of `scans`. As MapCore::Publish().
  absl::Status Publish(const std::vector<ScanId>& scans,
                       absl::FunctionRef<absl::Status(StorageWriter&)> decision);

  // Tiles that were put, of either kind.
  std::size_t changed() const {
    return keys_.tiles.size() + keys_.gone.size() + keys_.surfaces.size();
  }

 private:
  MapCore& core_;
  const std::uint64_t version_;
  bool published_ = false;
  TileRowKeys keys_;
  std::vector<api::TileChangeNotice> notices_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_STAGED_TILES_H_
