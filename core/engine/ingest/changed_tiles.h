// Scans that will be elsewhere, or in which other points count: the tiles they are in, and those
// they come to, are made again beside the current ones.
#ifndef STRATA_CORE_ENGINE_INGEST_CHANGED_TILES_H_
#define STRATA_CORE_ENGINE_INGEST_CHANGED_TILES_H_

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/ingest/changed_scans.h"
#include "core/engine/ingest/tiles_ahead.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/scans/scan_labels.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/staged_tiles.h"
#include "core/mls/mls_map.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

struct ChangedTilesOptions {
  std::uint64_t version = 0;
  int threads = 1;
  // Progress of the whole work when tiles begin to be joined, and to be annotated; it ends at 1.
  double joining = 0.0;
  double annotating = 0.5;
  // Takes what is damaged; nullptr: DATA_LOSS.
  DamagedScans* damaged = nullptr;
  // Tiles that are made already; nullptr: none are. Not together with `change_of`.
  const TilesAhead* ahead = nullptr;
  // What is said of a changed scan from now on; nullopt: what is stored.
  std::optional<absl::FunctionRef<LabelChange(const ScanRecord&)>> change_of;
};

// All must outlive it; `store` must be empty, and holds tiles as they will be afterwards. On the
// worker's thread.
class ChangedTiles {
 public:
  using KeySet = absl::btree_set<TileKey>;

  ChangedTiles(MapCore& core,
               MlsTileStore& store,
               StagedTiles& staged,
               const ChangedScans& scans,
               const ChangedTilesOptions& options,
               JobContext& context)
      : core_(core),
        store_(store),
        staged_(staged),
        scans_(scans),
        options_(options),
        context_(context),
        epoch_(core.snapshots().current().epoch) {}

  // Puts the tiles that the scans touch, or did, into `staged`; returns their keys.
  absl::StatusOr<KeySet> Stage(StorageReader& reader);

 private:
  // All scans of the tiles, as they will be; `changes` gets what is said of them.
  absl::StatusOr<std::vector<PlacedScanRecord>> ScansOfBlock(
      StorageReader& reader, const KeySet& keys, std::map<ScanNumber, LabelChange>& changes) const;
  // A block of tiles of `scans`; `gone` gets those where nothing is any more.
  absl::Status StageBlock(const std::vector<PlacedScanRecord>& scans,
                          const KeySet& keys,
                          MlsTileMap& gone);
  // The same where some of it is made: the tiles of `scans` out of `ahead`, with those that are not
  // in it.
  absl::Status StageAhead(const TilesAhead::Block& ahead,
                          const std::vector<PlacedScanRecord>& scans,
                          const KeySet& keys,
                          MlsTileMap& gone);
  // Returns the tiles where nothing is any more.
  absl::StatusOr<MlsTileMap> StageMlsTiles(StorageReader& reader, const KeySet& keys);
  absl::Status StageSurfaces(StorageReader& reader, const KeySet& keys, const MlsTileMap& gone);

  MapCore& core_;
  MlsTileStore& store_;
  StagedTiles& staged_;
  const ChangedScans& scans_;
  const ChangedTilesOptions options_;
  JobContext& context_;
  const std::uint64_t epoch_;  // the current one
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_CHANGED_TILES_H_
