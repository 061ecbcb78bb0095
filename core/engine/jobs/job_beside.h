// What is asked about jobs where another engine has the map: written into the store they share, in
// whose commits it is decided, and done by the other, which learns of it within a second or so.
// `store` as of MapStores::OpenToAdd(). Durable when it returns.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/storage/storage.h"
#include "core/world/job.h"

namespace strata {

// Errors of JobHandler::check. RESOURCE_EXHAUSTED while too many jobs wait.
absl::StatusOr<JobInfo> StartJobBeside(MapStorage& store,
                                       absl::string_view kind,
                                       const JobParameters& parameters);

// As of JobBoard, and of api::Jobs::Revert().
absl::StatusOr<JobInfo> CancelJobBeside(MapStorage& store, std::uint64_t id);
absl::StatusOr<JobInfo> AcceptJobBeside(MapStorage& store, std::uint64_t id);
absl::StatusOr<JobInfo> RevertJobBeside(MapStorage& store, std::uint64_t id);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_BESIDE_H_
