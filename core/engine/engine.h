// The database in this process: maps in a directory, behind the interfaces of core/api.
#ifndef STRATA_CORE_ENGINE_ENGINE_H_
#define STRATA_CORE_ENGINE_ENGINE_H_

#include <memory>

#include "absl/status/statusor.h"

#include "core/api/database.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"

namespace strata {

// Opens the directory. FAILED_PRECONDITION while another engine has it. A map is opened when a call
// needs it, and soon where pending scans or jobs have to go on by themselves; its unfinished
// uploads are dropped then but for announced ones. One whose file is damaged does not keep the
// others from being served: calls on it answer with what is wrong. The engine ends its threads when
// it is destroyed; no call may be under way then. `open`: where the maps are kept.
absl::StatusOr<std::unique_ptr<api::Database>> OpenEngine(const EngineOptions& options,
                                                          OpenStores open = OpenMapStores);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_ENGINE_H_
