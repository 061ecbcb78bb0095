// What an optimize job found, on its way to become an epoch.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_PROPOSAL_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_PROPOSAL_H_

#include <cstdint>

#include "absl/status/status.h"

#include "core/engine/ingest/integrator.h"
#include "core/engine/ingest/pose_change.h"
#include "core/engine/ingest/tiles_ahead.h"
#include "core/engine/map/job_context.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/world/job.h"

namespace strata {

// Beside the worker: makes what moving scans as ApplyProposal() will takes longest.
absl::Status MakeAhead(MapCore& core,
                       const JobInfo& job,
                       std::uint64_t base_epoch,
                       const MoveTolerance& tolerance,
                       int threads,
                       const Stop& stop,
                       TilesAhead& ahead);

// On the worker: makes what `job` has proposed the next epoch. Scans it says nothing about came in
// meanwhile and are carried by their partners; a scan that a person moved since `base_epoch`, which
// the proposal is of, stays where it was put. FAILED_PRECONDITION if the poses have been optimised
// or reverted since. Damaged scans are left out and put into `damaged`. `ahead`: what is made of it
// already; may be nullptr. Adds metrics to the job.
absl::Status ApplyProposal(Integrator& integrator,
                           const JobInfo& job,
                           std::uint64_t base_epoch,
                           const MoveTolerance& tolerance,
                           int threads,
                           DamagedScans& damaged,
                           const TilesAhead* ahead,
                           JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_PROPOSAL_H_
