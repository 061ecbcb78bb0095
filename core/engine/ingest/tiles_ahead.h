// Tiles of scans that are about to move, made before the worker is asked to move them: scans that
// come in meanwhile then wait for less.
#ifndef STRATA_CORE_ENGINE_INGEST_TILES_AHEAD_H_
#define STRATA_CORE_ENGINE_INGEST_TILES_AHEAD_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"

#include "core/common/stop.h"
#include "core/engine/ingest/changed_scans.h"
#include "core/engine/map/map_core.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/geometry/pose.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

// What it holds is right as long as nobody edits the map and the scans that are in its tiles come
// to be where they were said to be; whoever uses it asks. One thread at a time.
class TilesAhead {
 public:
  using KeySet = absl::btree_set<TileKey>;
  // Of a block of TileBlocks().
  struct Block {
    absl::btree_map<ScanNumber, Pose> scans;                   // all that are in its tiles
    absl::btree_map<TileKey, std::optional<MlsTileRow>> rows;  // nullopt: there is nothing
  };

  explicit TilesAhead(MapCore& core) : core_(core), edits_(core.edits()) {}

  // `moves`: integrated scans and where they will be. Reads the present state, beside the worker.
  // Memory: the tiles as they are stored, up to a bound; those beyond it are left to the worker.
  // After an error, be it of a damaged scan, all are.
  absl::Status Make(const std::vector<ProposedPose>& moves, int threads, const Stop& stop);

  // Whether nobody has edited the map since. On the worker's thread.
  bool IsOfNow() const { return core_.edits() == edits_; }
  // The scan at this pose; nullptr: not known.
  const ChangedScan* FindScan(ScanNumber number, const Pose& T_map_scan) const;
  // The block that `keys` lie in, if all that is in its tiles is among `scans`, at the same poses.
  const Block* Find(const KeySet& keys, const std::vector<PlacedScanRecord>& scans) const;

 private:
  absl::Status MakeBlocks(StorageReader& reader,
                          std::uint64_t epoch,
                          int threads,
                          const Stop& stop);

  MapCore& core_;
  const std::uint64_t edits_;
  ChangedScans moved_;
  std::vector<Block> blocks_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_TILES_AHEAD_H_
