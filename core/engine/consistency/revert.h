// Goes back to the poses and constraints of an earlier epoch, never to its scans.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_REVERT_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_REVERT_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/ingest/integrator.h"
#include "core/engine/map/job_context.h"
#include "core/world/job.h"

namespace strata {

// The one before the epoch that `job` made, which must be the current one. FAILED_PRECONDITION.
absl::StatusOr<std::uint64_t> EpochBefore(const JobInfo& job, std::uint64_t current);

// FAILED_PRECONDITION where a job that goes back waits or runs: another would undo what came
// between.
absl::Status CheckNoneReverts(const std::vector<JobInfo>& jobs);

// On the worker: makes the poses of `epoch` those of a new epoch.
// Scans that had none then are carried by their partners. NOT_FOUND for an epoch that never was,
// FAILED_PRECONDITION for one that is not kept.
absl::Status RunRevertJob(Integrator& integrator,
                          const JobInfo& job,
                          std::uint64_t epoch,
                          JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_REVERT_H_
