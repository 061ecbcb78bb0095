// A job that is started where another engine has the map: queued in the store they share, run by
// the other.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/storage/storage.h"
#include "core/world/job.h"

namespace strata {

// Durable when it returns. `store` as of MapStores::OpenToAdd(); errors of JobHandler::check.
// RESOURCE_EXHAUSTED while too many jobs wait.
absl::StatusOr<JobInfo> StartJobBeside(MapStorage& store,
                                       absl::string_view kind,
                                       const JobParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_
