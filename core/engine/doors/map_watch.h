// Follows a map: api::Maps::Watch of one map.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

#include "core/api/maps.h"
#include "core/common/stop.h"
#include "core/engine/map/map_core.h"

namespace strata {

absl::Status WatchMap(MapCore& core,
                      const Stop& stop,
                      const api::WatchOptions& options,
                      absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_
