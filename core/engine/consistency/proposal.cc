#include "core/engine/consistency/proposal.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/geometry/primitives.h"

namespace strata {
namespace {

// Whether a person moved the scan since the proposal; an error if something else did.
absl::StatusOr<bool> MovedByHand(const PoseRecord& pose, std::uint64_t base_epoch) {
  if (pose.epoch <= base_epoch || pose.origin == PoseOrigin::kIngest) return false;
  if (pose.origin == PoseOrigin::kPerson) return true;
  return absl::FailedPreconditionError(absl::StrCat("the map went from epoch ",
                                                    base_epoch,
                                                    " to ",
                                                    pose.epoch,
                                                    " since this was proposed; start another"));
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

struct PoseBeforeAndAfter {
  Pose before, after;
};
using PosesOfScans = std::map<ScanNumber, PoseBeforeAndAfter>;

PosesOfScans BeforeAndAfter(const PoseChange& change, const std::vector<ProposedPose>& moves) {
  PosesOfScans poses;
  for (const PosedScan& posed : change.scans()) {
    poses[posed.scan.number] = {posed.pose->T_map_scan, posed.pose->T_map_scan};
  }
  for (const ProposedPose& move : moves) poses.at(move.scan).after = move.T_map_scan;
  return poses;
}

Plane InScan(const Pose& T_map_scan, const Plane& plane_map) {
  return {T_map_scan.linear().transpose() * plane_map.normal,
          plane_map.distance - plane_map.normal.dot(T_map_scan.translation())};
}

// Whether a scan sees both in one place, each at the poses that it is of.
bool AreOnePlane(const PlaneRecord& before, const PlaneRecord& after, const PosesOfScans& poses) {
  constexpr double kSameCosine = 0.9986;
  constexpr double kSameDistanceM = 0.2;
  return std::ranges::any_of(before.scans, [&](ScanNumber scan) {
    const auto pose = poses.find(scan);
    if (pose == poses.end() || std::ranges::find(after.scans, scan) == after.scans.end()) {
      return false;
    }
    const Plane was = InScan(pose->second.before, before.plane.plane);
    const Plane is = InScan(pose->second.after, after.plane.plane);
    return was.normal.dot(is.normal) >= kSameCosine &&
           std::abs(was.distance - is.distance) <= kSameDistanceM;
  });
}

// Between the same two scans, found by the same means.
bool AreOneClosure(const ConstraintRecord& a, const ConstraintRecord& b) {
  return a.scan_i == b.scan_i && a.scan_j == b.scan_j && a.constraint.origin == b.constraint.origin;
}

// What another proposal brought meanwhile is there once.
absl::Status DropSecondClosures(StorageWriter& writer,
                                const std::vector<ConstraintRecord>& before,
                                const std::vector<ConstraintRecord>& after) {
  std::set<std::uint64_t> known;
  for (const ConstraintRecord& record : before) known.insert(record.constraint.id);
  for (const ConstraintRecord& now : after) {
    const bool is_second = !known.contains(now.constraint.id) &&
                           std::ranges::any_of(before, [&](const ConstraintRecord& record) {
                             return AreOneClosure(record, now);
                           });
    if (is_second) STRATA_RETURN_IF_ERROR(writer.DeleteConstraint(now.constraint.id));
  }
  return absl::OkStatus();
}

// Planes that were switched off after the job had looked stay off.
absl::Status Adopt(StorageWriter& writer, const JobInfo& job, const PosesOfScans& poses) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlaneRecord> before,
                          writer.reader().ListPlanes(clock.epoch));
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> held,
                          writer.reader().ListConstraints(clock.epoch));
  STRATA_RETURN_IF_ERROR(writer.AdoptProposal(job.id));
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> holding,
                          writer.reader().ListConstraints(clock.epoch));
  STRATA_RETURN_IF_ERROR(DropSecondClosures(writer, held, holding));
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlaneRecord> after,
                          writer.reader().ListPlanes(clock.epoch));
  for (const PlaneRecord& now : after) {
    const bool is_off = now.plane.enabled && std::ranges::any_of(before, [&](const auto& record) {
                          return !record.plane.enabled && AreOnePlane(record, now, poses);
                        });
    if (is_off) STRATA_RETURN_IF_ERROR(writer.EnableConstraint(now.plane.id, false));
  }
  return absl::OkStatus();
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
  const PosesOfScans poses = BeforeAndAfter(change, outcome.moves);
  const auto adopt = [&](StorageWriter& writer) { return Adopt(writer, job, poses); };
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
