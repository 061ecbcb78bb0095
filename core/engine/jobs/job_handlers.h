// What the engine does for each kind of job: the other half of the table in core/world/job_kinds.h.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_HANDLERS_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_HANDLERS_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/engine/ingest/worker.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/storage/storage.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"

namespace strata {

// A job whose turn it is.
struct JobRun {
  MapCore& core;
  Worker* worker;  // nullptr: another engine has the map
  const JobInfo& job;
  const JobArguments& arguments;  // of job.parameters
  JobContext& context;
};

struct JobHandler {
  absl::string_view kind;
  // What the job needs that is not there, said before it waits for its turn; INVALID_ARGUMENT for
  // arguments that do not go together.
  absl::Status (*check)(StorageReader& reader, const JobArguments& arguments);
  // On the thread of jobs.
  absl::Status (*run)(const JobRun& run);
  // It asks nothing of who has the map, but to apply what it proposes: whatever engine can run it,
  // on `core` alone.
  bool anywhere = false;
};

// One of each of JobKinds().
const std::vector<JobHandler>& JobHandlers();
// INVALID_ARGUMENT for a kind that there is not.
absl::StatusOr<const JobHandler*> FindJobHandler(absl::string_view kind);

// Whether jobs of the kind can be run by an engine that has not got the map, and whether this one
// can as it is now.
bool RunsAnywhere(absl::string_view kind);
bool RunsAnywhere(const JobInfo& job);
// Does what the job asks for. `worker` as of JobRun.
absl::Status RunHandler(MapCore& core, Worker* worker, const JobInfo& job, JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_HANDLERS_H_
