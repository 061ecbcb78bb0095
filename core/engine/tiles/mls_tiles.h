// Level-0 tiles with all their statistics: read from the store, joined from contributions.
#ifndef STRATA_CORE_ENGINE_TILES_MLS_TILES_H_
#define STRATA_CORE_ENGINE_TILES_MLS_TILES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/steady_view.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/scans/scan_labels.h"
#include "core/mls/mls_map.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

using MlsTilePtr = std::shared_ptr<const MlsTile>;
// Tiles by key; nullptr: there is nothing any more.
using MlsTileMap = absl::btree_map<TileKey, MlsTilePtr>;

// A scan where it is.
struct PlacedScanRecord {
  ScanRecord scan;
  Pose T_map_scan = Pose::Identity();
  const LabelChange* change = nullptr;  // as if this had been stored already
};

// Keys of the tiles that have patches.
std::vector<TileKey> TilesOf(const MlsMap& contribution);

// Bytes a tile takes in memory.
std::size_t MemoryBytes(const MlsTile& tile);

// Around all patches of a tile. `cell_size_m` of the map.
Eigen::AlignedBox3d BoxOf(const MlsTile& tile, double cell_size_m);

// The row of a tile; errors of EncodeMlsTile.
absl::StatusOr<MlsTileRow> MakeMlsTileRow(const MlsTile& tile,
                                          std::uint64_t version,
                                          double cell_size_m);

// Whether each tile of `contribution`, joined with what `tiles` has there, can be kept:
// OUT_OF_RANGE, naming the first that cannot, the bound and the cure.
absl::Status CheckRoomInTiles(const MlsMap& contribution, const MlsTileMap& tiles);

// Joins the tiles of `contribution` into `tiles`, which must hold (maybe as nullptr) every tile it
// touches, but those that `wanted` does not take.
void JoinContribution(const MlsMap& contribution,
                      absl::FunctionRef<bool(const TileKey&)> wanted,
                      MlsTileMap& tiles);

// The tiles `keys` out of the contributions of `scans` alone, by `threads` threads; the same bytes
// for any number. Keys that get nothing are nullptr. Memory: the tiles and a scan a thread. Damaged
// scans are put into `damaged`; where that is nullptr, DATA_LOSS naming one. `view`: what is read,
// by as many threads at most; nullptr: the present state.
absl::StatusOr<MlsTileMap> MakeTiles(MapCore& core,
                                     const std::vector<PlacedScanRecord>& scans,
                                     const absl::btree_set<TileKey>& keys,
                                     int threads,
                                     const Stop& stop,
                                     DamagedScans* damaged = nullptr,
                                     const SteadyView* view = nullptr);

// Stored tiles, decoded ones kept. Two threads may load at once, and load what is not replaced
// while Replace() runs.
class MlsTileStore {
 public:
  explicit MlsTileStore(MapCore& core) : core_(core), cache_(core.caches()) {}

  // As of `version`; nullptr where there is nothing. A damaged tile is made again from its scans.
  absl::StatusOr<MlsTilePtr> Load(StorageReader& reader, const TileKey& key, std::uint64_t version);
  // `tiles` are the current ones from now on.
  void Replace(const MlsTileMap& tiles);
  void Clear() { cache_.Clear(); }

 private:
  MapCore& core_;
  LruCache<TileKey, const MlsTile> cache_;
};

// All integrated scans with a tile in `keys`, by number, at their poses of `epoch`; damaged rows as
// of MakeTiles.
absl::StatusOr<std::vector<PlacedScanRecord>> ScansOfTiles(StorageReader& reader,
                                                           const absl::btree_set<TileKey>& keys,
                                                           std::uint64_t epoch,
                                                           DamagedScans* damaged = nullptr);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_MLS_TILES_H_
