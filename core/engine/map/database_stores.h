// The maps of one database, as an engine keeps them.
#ifndef STRATA_CORE_ENGINE_MAP_DATABASE_STORES_H_
#define STRATA_CORE_ENGINE_MAP_DATABASE_STORES_H_

#include <memory>

#include "absl/status/statusor.h"

#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/storage/postgresql/postgres_maps.h"

namespace strata {

// That of options.store, for an engine in `directory`.
absl::StatusOr<PostgresOptions> DatabaseOf(const EngineOptions& options,
                                           const MapDirectory& directory);

absl::StatusOr<std::unique_ptr<MapStores>> OpenDatabaseStores(const PostgresOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_DATABASE_STORES_H_
