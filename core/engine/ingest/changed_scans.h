// Scans as they will be: at other poses, or with other points that count.
#ifndef STRATA_CORE_ENGINE_INGEST_CHANGED_SCANS_H_
#define STRATA_CORE_ENGINE_INGEST_CHANGED_SCANS_H_

#include <cstdint>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/geometry/pose.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

struct ChangedScan {
  ScanRecord scan;
  Pose T_map_scan = Pose::Identity();
  std::vector<TileKey> tiles;  // that it touches from now on
};
using ChangedScans = absl::btree_map<ScanNumber, ChangedScan>;

// A scan of `epoch` at another pose. A damaged one is put into `damaged` and touches nothing; where
// that is nullptr, DATA_LOSS naming it.
absl::StatusOr<ChangedScan> MovedScan(MapCore& core,
                                      const ProposedPose& move,
                                      std::uint64_t epoch,
                                      DamagedScans* damaged);

// All scans of the tiles `keys` as they will be once `changed` have changed; damaged rows as of
// MakeTiles().
absl::StatusOr<std::vector<PlacedScanRecord>> ScansToBe(StorageReader& reader,
                                                        const absl::btree_set<TileKey>& keys,
                                                        const ChangedScans& changed,
                                                        std::uint64_t epoch,
                                                        DamagedScans* damaged);

// The tiles that the scans are in now or will be.
absl::StatusOr<absl::btree_set<TileKey>> TilesToChange(StorageReader& reader,
                                                       const ChangedScans& changed);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_CHANGED_SCANS_H_
