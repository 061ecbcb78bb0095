// Tiles of level 0 as the poses of an earlier epoch make them. Nothing of it is stored.
#ifndef STRATA_CORE_ENGINE_TILES_EPOCH_TILES_H_
#define STRATA_CORE_ENGINE_TILES_EPOCH_TILES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/storage/storage.h"

namespace strata {

// NOT_FOUND for an epoch that does not exist yet; `too_old` where its poses are not kept.
absl::Status CheckEpochKept(StorageReader& reader,
                            std::uint64_t epoch,
                            absl::StatusCode too_old = absl::StatusCode::kNotFound);

// The scans that are integrated now and had a pose in the epoch, at that pose. Most of them did not
// move since, so most tiles are the stored ones; the others are made from their scans. One thread
// at a time. Memory: the rows of the scans, and what is asked for.
class EpochTiles {
 public:
  // The tiles of `epoch`, earlier than the current one, inside `range` of level 0. DATA_LOSS naming
  // a damaged scan; NOT_FOUND for an epoch that is not kept.
  static absl::StatusOr<std::unique_ptr<EpochTiles>> Find(MapCore& core,
                                                          std::uint64_t epoch,
                                                          const TileRange& range,
                                                          const Stop& stop);

  // What the stored tiles are read as of; they stay readable as long as this lives.
  const MapView& view() const { return pin_.view(); }
  // Those of the range that may not be as they are stored.
  const absl::btree_set<TileKey>& differing() const { return differing_; }
  // Makes those of `keys`, all of differing(), that are not as they are stored: rows of version 0,
  // by key. DATA_LOSS naming a damaged scan; ABORTED naming one that was deleted since Find().
  absl::StatusOr<SurfaceTileMaker::Rows> Make(const absl::btree_set<TileKey>& keys,
                                              const Stop& stop) const;

 private:
  EpochTiles(MapCore& core, Snapshots::Pin pin, const TileRange& range)
      : core_(core), pin_(std::move(pin)), range_(range) {}

  // False: the store is ahead of the pinned view.
  absl::StatusOr<bool> Read(StorageReader& reader, std::uint64_t epoch, const Stop& stop);
  absl::Status FindTiles(StorageReader& reader,
                         const absl::btree_map<ScanNumber, Pose>& now,
                         const Stop& stop);
  // Whether a tile, or one beside it, lies in the range.
  bool Near(const TileKey& key) const;
  absl::Status Explain(const absl::Status& status,
                       const std::vector<PlacedScanRecord>& scans) const;

  MapCore& core_;
  const Snapshots::Pin pin_;
  const TileRange range_;
  std::vector<PlacedScanRecord> scans_;  // at the epoch's poses, by number
  absl::btree_map<TileKey, std::vector<std::size_t>> scans_of_tile_;  // indices into scans_
  absl::btree_set<TileKey> differing_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_EPOCH_TILES_H_
