// The database in this process: maps in a directory, behind the interfaces of core/api.
#ifndef STRATA_CORE_ENGINE_ENGINE_H_
#define STRATA_CORE_ENGINE_ENGINE_H_

#include <memory>

#include "absl/status/statusor.h"

#include "core/api/database.h"
#include "core/engine/map/engine_options.h"

namespace strata {

// Opens the directory: unfinished uploads are dropped but for announced ones, pending scans and
// jobs go on by themselves. FAILED_PRECONDITION while another engine has it. A map whose file is
// damaged does not keep the others from being served: calls on it answer with what is wrong. The
// engine ends its threads when it is destroyed; no call may be under way then.
absl::StatusOr<std::unique_ptr<api::Database>> OpenEngine(const EngineOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_ENGINE_H_
