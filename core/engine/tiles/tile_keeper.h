// Prepares the tiles of a map that has come to rest for plans to come, and keeps them in its file.
#ifndef STRATA_CORE_ENGINE_TILES_TILE_KEEPER_H_
#define STRATA_CORE_ENGINE_TILES_TILE_KEEPER_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/engine/map/map_core.h"
#include "core/engine/map/quarantine.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/storage/records.h"
#include "core/world/robot_profile.h"

namespace strata {

// Keeps every tile that nothing has changed for EngineOptions::prepare_after, by key, prepared for
// the map's default robot. The worker's: nobody else changes tiles meanwhile. In a process one tile
// is prepared at a time, whatever its map, with some 50 MB; while tiles of the map change, a tenth
// of the time at most. Memory: some 60 bytes a tile of the map.
class TileKeeper {
 public:
  // Both must outlive it.
  TileKeeper(MapCore& core, Quarantine& quarantine);

  // Looks what is to be done, and does it for one tile: some 50 ms. Returns when to call it again.
  // What fails is told in the log, once until something succeeds, and tried again later.
  absl::Duration Step();
  // Whether Step() found nothing to do that it can do, since Pause() or before it: what it waits
  // for is that tiles change, or that what fails goes better. Thread-safe.
  bool AtRest() const { return at_rest_; }
  // Other work begins, or the map is closed: what the process dies of now is not preparing tiles.
  void Pause();

 private:
  class Source;

  absl::StatusOr<absl::Duration> TryStep();
  // Brings versions_ and stale_ up to date with the map.
  absl::Status Look();
  absl::Status List(const MapView& view);
  // A tile that is to be prepared now, or whose row is to go.
  std::optional<TileKey> NextDue() const;
  // Whether preparing tiles may go on as far as the deaths of the process tell.
  absl::StatusOr<bool> Begin();
  absl::Status End();
  absl::Status Keep(const TileKey& key);

  MapCore& core_;
  Quarantine& quarantine_;
  const absl::Duration quiet_;
  bool listed_ = false;
  std::uint64_t seen_ = 0;  // changes up to it are in the maps below
  absl::Time changed_ = absl::InfinitePast();
  RobotProfile profile_;
  TileVersionMap versions_;
  absl::btree_map<TileKey, absl::Time> stale_;  // since when
  // Decoded around the last tile: the next one is often beside it.
  absl::btree_map<TileKey, std::shared_ptr<const SurfaceTile>> decoded_;
  bool under_way_ = false;  // as the quarantine knows
  bool failed_ = false;     // as the log knows
  std::atomic<bool> at_rest_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_TILE_KEEPER_H_
