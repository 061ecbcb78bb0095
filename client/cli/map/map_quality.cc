#include "client/cli/map/map_quality.h"

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/posegraph/constraint_residual.h"
#include "core/common/status.h"
#include "core/posegraph/closures/closure_consistency.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

void AddLoop(const ConstraintResidual& residual, MapQuality& quality) {
  const Constraint& constraint = *residual.constraint;
  if (constraint.is_prior() || constraint.origin == ConstraintOrigin::kIngest) return;
  if (!constraint.enabled) {
    ++quality.loops_not_believed;
  } else if (ClosureHolds(constraint.T_i_j, residual.T_map_i, residual.T_map_j)) {
    ++quality.loops_closed;
  } else {
    ++quality.loops_open;
  }
}

}  // namespace

absl::StatusOr<MapQuality> QualityOf(api::Database& database,
                                     const api::Call& call,
                                     const std::string& map) {
  MapQuality quality;
  const absl::Status listed = database.scans().List(call, map, {}, [&](const ScanInfo& scan) {
    if (scan.state != ScanState::kIntegrated) return absl::OkStatus();
    quality.alignment.Add(scan);
    quality.scans_moved_by_jobs += absl::StrContains(scan.alignment.message, ", job ") ? 1 : 0;
    return absl::OkStatus();
  });
  if (!absl::IsDataLoss(listed)) STRATA_RETURN_IF_ERROR(listed);
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, database.jobs().List(call, map));
  for (const JobInfo& job : jobs) {
    const bool sets_poses = job.kind == kOptimizeJob || job.kind == kRevertJob;
    if (sets_poses && job.state == JobState::kSucceeded) {
      quality.optimized = absl::StrCat("job ", job.id, ": ", job.message);
    }
  }
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState graph, database.posegraph().Get(call, map));
  for (const ConstraintResidual& residual : ResidualsOf(graph)) AddLoop(residual, quality);
  return quality;
}

void AddQuality(const MapQuality& quality, bool for_programs, Json& json) {
  AddHealth(quality.alignment, for_programs, json);
  if (quality.scans_moved_by_jobs > 0) json["scans_moved_by_jobs"] = quality.scans_moved_by_jobs;
  if (!quality.optimized.empty()) json["optimized"] = quality.optimized;
  if (quality.loops_closed + quality.loops_open + quality.loops_not_believed == 0) return;
  if (!for_programs) {
    json["loops"] = absl::StrFormat("%d closed, %d open, %d not believed",
                                    quality.loops_closed,
                                    quality.loops_open,
                                    quality.loops_not_believed);
    return;
  }
  json["loops_closed"] = quality.loops_closed;
  json["loops_open"] = quality.loops_open;
  json["loops_not_believed"] = quality.loops_not_believed;
}

}  // namespace strata::cli
