// Makes the poses of a map globally consistent (thesis 7.4.3, Algorithm 4).
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_H_

#include "absl/status/status.h"

#include "core/engine/ingest/worker.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"

namespace strata {

// Runs the job beside uploads, integration and reads; only the making of the next epoch is the
// worker's. A dry run, and any run until then, leaves nothing but a proposal, which is left to who
// has the map (JobContext::SetAccepted()) where `worker` is nullptr.
absl::Status RunOptimizeJob(MapCore& core,
                            Worker* worker,
                            const JobInfo& job,
                            const JobArguments& arguments,
                            JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_OPTIMIZE_H_
