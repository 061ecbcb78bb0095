// Counts of a map.
#ifndef STRATA_CORE_ENGINE_TILES_MAP_STATS_H_
#define STRATA_CORE_ENGINE_TILES_MAP_STATS_H_

#include "absl/status/statusor.h"

#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// Of one committed state, in whose snapshot it is called. The content digest is the hash over key
// and content hash of every level-0 tile with all its statistics, in key order.
absl::StatusOr<MapStats> CollectStats(StorageReader& reader, const MapClock& clock);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_TILES_MAP_STATS_H_
