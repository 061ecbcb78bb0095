// What is inferred of a map's things, cell by cell, as plans are kept out of it.
#ifndef STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_
#define STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"

#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/world/things/inferred_tile.h"

namespace strata {

struct InferredState {
  std::uint64_t changed = 0;           // ChangeSet::inferred that it is not older than
  std::optional<std::uint64_t> epoch;  // whose poses it stands on; none: nothing is inferred
  InferredTileMap tiles;
};

// Reads it all when it is first asked for after a change, and keeps it as long as it fits the
// caches of all maps. Thread-safe.
class InferredTiles {
 public:
  explicit InferredTiles(MapCore& core) : core_(core), state_(core.caches()) {}

  // Not older than what watchers have been told of before the call. DATA_LOSS naming the entity
  // that is damaged; ABORTED where it changed again and again meanwhile; CANCELLED,
  // DEADLINE_EXCEEDED.
  absl::StatusOr<std::shared_ptr<const InferredState>> Now(const Stop& stop);

 private:
  absl::StatusOr<std::shared_ptr<const InferredState>> Load(const Stop& stop) const;

  static constexpr int kOnly = 0;

  MapCore& core_;
  LruCache<int, const InferredState> state_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_
