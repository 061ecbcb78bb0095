// Tiles as bytes, as readers get them: read and checked once, kept for the next who asks.
#ifndef STRATA_CORE_ENGINE_TILES_SERVED_TILES_H_
#define STRATA_CORE_ENGINE_TILES_SERVED_TILES_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

#include "core/common/lru_cache.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/mls/tile_key.h"

namespace strata {

// Thread-safe.
class ServedTiles {
 public:
  struct Tile {
    std::uint64_t version = 0;
    std::string bytes;  // an intact blob of core/codec
  };
  using Handle = std::shared_ptr<const Tile>;

  // `core` must outlive this. Keeps at most an eighth of
  // EngineOptions::cache_bytes.
  explicit ServedTiles(MapCore& core)
      : core_(core), known_(core.caches(), core.options().cache_bytes / kCacheShare) {}

  // The tile that readers of `view`, which must be pinned, get; nullptr where there is nothing.
  // DATA_LOSS if it is damaged.
  absl::StatusOr<Handle> Find(const TileKey& key, const MapView& view);
  // The same where it is in memory; nullptr where it is not.
  Handle FindAtHand(const TileKey& key, const MapView& view);

 private:
  static constexpr std::size_t kCacheShare = 8;
  // A tile, and up to which tile version nothing newer than it exists.
  struct Known {
    Handle tile;
    std::uint64_t until = 0;
  };

  // Whether it is what readers of `view` get: rows up to a published version are all there, and
  // none comes in between later.
  static bool Serves(const Known& known, const MapView& view) {
    return known.tile->version <= view.tile_version && view.tile_version <= known.until;
  }
  void Keep(const TileKey& key, Known known);
  absl::StatusOr<Handle> Read(StorageReader& reader, const TileKey& key, const MapView& view);

  MapCore& core_;
  LruCache<TileKey, const Known> known_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_SERVED_TILES_H_
