// What is inferred of a map's things, cell by cell, as plans are kept out of it.
#ifndef STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_
#define STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"

#include "core/common/cache_budget.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_state.h"
#include "core/world/things/inferred_tile.h"

namespace strata {

struct InferredState {
  std::uint64_t changed = 0;           // ChangeSet::inferred that it is not older than
  std::optional<std::uint64_t> epoch;  // whose poses it stands on; none: nothing is inferred
  InferredTileMap tiles;
};

// Of a map that is open here all is read when it is first asked for after a change, and kept as
// long as it fits the caches of all maps; of others by each call, since nobody tells when it
// changes. Thread-safe.
class InferredTiles {
 public:
  InferredTiles(double cell_size_m, const std::shared_ptr<CacheBudget>& caches)
      : cell_size_m_(cell_size_m), kept_(caches) {}

  // Not older than `state`. DATA_LOSS naming the entity that is damaged; ABORTED where it changed
  // again and again meanwhile; CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::shared_ptr<const InferredState>> Now(const MapState& state, const Stop& stop);

 private:
  absl::StatusOr<std::shared_ptr<const InferredState>> Load(const MapState& state,
                                                            const Stop& stop) const;

  static constexpr int kOnly = 0;

  const double cell_size_m_;
  LruCache<int, const InferredState> kept_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_INFERRED_TILES_H_
