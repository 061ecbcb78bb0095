#include "core/engine/consistency/proposal.h"

#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

// Whether a person moved the scan since the proposal; an error if something else did.
absl::StatusOr<bool> MovedByHand(const PoseRecord& pose, std::uint64_t base_epoch) {
  if (pose.epoch <= base_epoch || pose.origin == PoseOrigin::kIngest) return false;
  if (pose.origin == PoseOrigin::kPerson) return true;
  return absl::FailedPreconditionError(
      absl::StrCat("the map went from epoch ",
                   base_epoch,
                   " to ",
                   pose.epoch,
                   " since this was proposed; revert the job and start another"));
}

absl::StatusOr<PoseChange> ReadChange(MapCore& core, const JobInfo& job, std::uint64_t base_epoch) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(PoseChange change,
                          PoseChange::Read(*reader, core.snapshots().current().epoch));
  STRATA_ASSIGN_OR_RETURN(const std::vector<ProposedPose> proposed,
                          reader->ListProposedPoses(job.id));
  std::map<ScanNumber, Pose> wanted;
  for (const ProposedPose& pose : proposed) wanted[pose.scan] = pose.T_map_scan;
  for (const PosedScan& posed : change.scans()) {
    const auto it = wanted.find(posed.scan.number);
    if (it == wanted.end()) continue;
    STRATA_ASSIGN_OR_RETURN(const bool by_hand, MovedByHand(*posed.pose, base_epoch));
    change.Decide(posed.scan.number, by_hand ? posed.pose->T_map_scan : it->second);
  }
  return change;
}

}  // namespace

absl::Status MakeAhead(MapCore& core,
                       const JobInfo& job,
                       std::uint64_t base_epoch,
                       const MoveTolerance& tolerance,
                       int threads,
                       const Stop& stop,
                       TilesAhead& ahead) {
  STRATA_ASSIGN_OR_RETURN(const PoseChange change, ReadChange(core, job, base_epoch));
  return ahead.Make(change.Resolve(tolerance).moves, threads, stop);
}

absl::Status ApplyProposal(Integrator& integrator,
                           const JobInfo& job,
                           std::uint64_t base_epoch,
                           const MoveTolerance& tolerance,
                           int threads,
                           DamagedScans& damaged,
                           const TilesAhead* ahead,
                           JobContext& context) {
  MapCore& core = integrator.core();
  STRATA_ASSIGN_OR_RETURN(const PoseChange change, ReadChange(core, job, base_epoch));
  PoseChange::Outcome outcome = change.Resolve(tolerance);
  const auto adopt = [&job](StorageWriter& writer) { return writer.AdoptProposal(job.id); };
  MoveOutcome moved;
  moved.epoch = core.snapshots().current().epoch;
  context.SetMetric("epoch_before", static_cast<double>(moved.epoch));
  context.SetMetric("scans_carried", static_cast<double>(outcome.carried));
  context.SetMetric("scans_moved", static_cast<double>(outcome.moves.size()));
  if (outcome.moves.empty()) {
    STRATA_RETURN_IF_ERROR(core.writer().Run(Durability::kFull, 0, Stop(), adopt));
  } else {
    ScanMoves moves;
    moves.poses = std::move(outcome.moves);
    moves.origin = PoseOrigin::kOptimize;
    moves.reason = absl::StrCat(job.kind, ", job ", job.id);
    moves.job = job.id;
    moves.damaged = &damaged;
    moves.ahead = ahead;
    STRATA_ASSIGN_OR_RETURN(moved, integrator.MoveScans(moves, threads, context, adopt));
  }
  context.SetMetric("epoch", static_cast<double>(moved.epoch));
  context.SetMetric("tiles_changed", static_cast<double>(moved.tiles));
  return absl::OkStatus();
}

}  // namespace strata
