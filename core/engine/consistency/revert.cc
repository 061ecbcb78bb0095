#include "core/engine/consistency/revert.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/ingest/pose_change.h"
#include "core/engine/tiles/epoch_tiles.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

absl::StatusOr<PoseChange> ReadChange(MapCore& core, std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_RETURN_IF_ERROR(CheckEpochKept(*reader, epoch, absl::StatusCode::kFailedPrecondition));
  STRATA_ASSIGN_OR_RETURN(PoseChange change,
                          PoseChange::Read(*reader, core.snapshots().current().epoch));
  STRATA_ASSIGN_OR_RETURN(const PoseChange then, PoseChange::Read(*reader, epoch));
  for (const PosedScan& posed : then.scans()) {
    change.Decide(posed.scan.number, posed.pose->T_map_scan);
  }
  return change;
}

}  // namespace

absl::Status CheckNoneReverts(const std::vector<JobInfo>& jobs) {
  const auto reverts = std::ranges::find_if(
      jobs, [](const JobInfo& job) { return job.kind == kRevertJob && !IsFinal(job.state); });
  if (reverts == jobs.end()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("job ", reverts->id, " goes back already; wait for it"));
}

absl::StatusOr<std::uint64_t> EpochBefore(const JobInfo& job, std::uint64_t current) {
  const auto before = job.metrics.find("epoch_before");
  const auto made = job.metrics.find("epoch");
  if (job.state != JobState::kSucceeded || before == job.metrics.end() ||
      made == job.metrics.end() || made->second == before->second) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job.id, " made no epoch that could be reverted"));
  }
  if (made->second != static_cast<double>(current)) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ",
                     job.id,
                     " made epoch ",
                     made->second,
                     ", but the map is at ",
                     current,
                     " by now; name the epoch to go back to: map revert"));
  }
  return static_cast<std::uint64_t>(before->second);
}

absl::Status RunRevertJob(Integrator& integrator,
                          const JobInfo& job,
                          std::uint64_t epoch,
                          JobContext& context) {
  MapCore& core = integrator.core();
  STRATA_ASSIGN_OR_RETURN(const PoseChange change, ReadChange(core, epoch));
  PoseChange::Outcome outcome = change.Resolve({.translation_m = 0.0, .rotation_rad = 0.0});
  ScanMoves moves;
  moves.poses = std::move(outcome.moves);
  moves.origin = PoseOrigin::kRevert;
  moves.reason = absl::StrCat("back to epoch ", epoch, ", job ", job.id);
  moves.job = job.id;
  DamagedScans damaged;
  moves.damaged = &damaged;
  context.SetMetric("epoch_before", static_cast<double>(core.snapshots().current().epoch));
  context.SetMetric("scans_moved", static_cast<double>(moves.poses.size()));
  context.SetMetric("scans_carried", static_cast<double>(outcome.carried));
  STRATA_ASSIGN_OR_RETURN(
      const MoveOutcome moved,
      integrator.MoveScans(
          moves, core.options().worker_threads, context, [&](StorageWriter& writer) {
            return writer.RestoreConstraints(epoch);
          }));
  context.SetMetric("epoch", static_cast<double>(moved.epoch));
  context.SetMetric("tiles_changed", static_cast<double>(moved.tiles));
  damaged.SetMetrics(context);
  context.SetMessage(absl::StrCat("poses and constraints of epoch ",
                                  epoch,
                                  " are back as epoch ",
                                  moved.epoch,
                                  damaged.Message()));
  return absl::OkStatus();
}

}  // namespace strata
