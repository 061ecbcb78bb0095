// The job "fade": what has gone leaves the map.
#ifndef STRATA_CORE_ENGINE_LABELS_FADE_H_
#define STRATA_CORE_ENGINE_LABELS_FADE_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/ingest/worker.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"

namespace strata {

// Whether the map lets things fade by itself, and has enough scans that no job of `jobs` has taken
// into account.
absl::StatusOr<bool> FadingIsDue(MapCore& core, const std::vector<JobInfo>& jobs);

// Asks of every point of an integrated scan whether later scans, in commit order, looked through
// where it was (core/mls/see_through.h), at the poses of the epoch in which the job begins. Points
// that have gone stay in their scans and are no part of their contributions any more: a decision,
// recorded with its evidence. The result depends on scans, poses and settings only, not on what
// earlier jobs decided. Takes effect at once, at its end; a scan that is deleted meanwhile is left
// out. DATA_LOSS where a scan is damaged.
absl::Status RunFadeJob(MapCore& core,
                        Worker& worker,
                        const JobArguments& arguments,
                        JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LABELS_FADE_H_
