// Everything derived against everything it follows from: `verify` reports what differs, beside all
// other work; `rebuild` puts it right. Both make all of it again from truth.
#ifndef STRATA_CORE_ENGINE_REPAIR_REBUILD_H_
#define STRATA_CORE_ENGINE_REPAIR_REBUILD_H_

#include "absl/status/status.h"

#include "core/common/stop.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"

namespace strata {

// Looks at one state of the map while uploads, edits and integration go on; DATA_LOSS naming what
// does not fit in it.
absl::Status RunVerifyJob(MapCore& core, int threads, JobContext& context);

// On the worker's thread.
absl::Status RunRebuildJob(Integrator& integrator, int threads, JobContext& context);

// Rebuilds at once, as a Worker::Recovery.
absl::Status RecoverDerived(Integrator& integrator, const Stop& closing);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_REPAIR_REBUILD_H_
