#include "core/engine/pose_change.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "absl/status/status.h"

#include "core/common/status.h"

namespace strata {
namespace {

bool Moves(const Pose& before, const Pose& after, const MoveTolerance& tolerance) {
  const Pose change = before.inverse() * after;
  return change.translation().norm() > tolerance.translation_m ||
         RotationAngleRad(change) > tolerance.rotation_rad;
}

}  // namespace

absl::StatusOr<PoseChange> PoseChange::Read(StorageReader& reader, std::uint64_t epoch) {
  PoseChange change;
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // it keeps its pose, and verify names it
  for (bool more = true; more;) {
    STRATA_ASSIGN_OR_RETURN(std::vector<PosedScan> page, reader.ListScans(query, epoch));
    more = page.size() == query.limit;
    if (!page.empty()) query.after = page.back().scan.number;
    for (PosedScan& posed : page) {
      if (posed.pose.has_value()) change.scans_.push_back(std::move(posed));
    }
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> constraints,
                          reader.ListConstraints(epoch));
  for (const ConstraintRecord& record : constraints) {
    if (record.constraint.is_prior()) continue;
    const auto [older, younger] = std::minmax(record.scan_i, record.scan_j);
    change.partners_[younger].push_back(older);
  }
  std::map<std::string, std::map<std::uint64_t, ScanNumber>> trajectories;
  for (const PosedScan& posed : change.scans_) {
    const ScanId& id = posed.scan.header.id;
    std::map<std::uint64_t, ScanNumber>& trajectory = trajectories[id.trajectory];
    const auto own = trajectory.insert({id.sequence, posed.scan.number}).first;
    if (own == trajectory.begin()) continue;
    change.partners_[posed.scan.number].push_back(std::prev(own)->second);
  }
  return change;
}

PoseChange::Outcome PoseChange::Resolve(const MoveTolerance& tolerance) const {
  Outcome outcome;
  std::map<ScanNumber, std::pair<Pose, Pose>> known;  // before and after; older ones come first
  for (const PosedScan& posed : scans_) {
    const ScanNumber number = posed.scan.number;
    const Pose& before = posed.pose->T_map_scan;
    Pose after = before;
    if (const auto decided = decided_.find(number); decided != decided_.end()) {
      after = decided->second;
    } else if (const auto partners = partners_.find(number); partners != partners_.end()) {
      ++outcome.carried;
      for (const ScanNumber partner : partners->second) {
        const auto it = known.find(partner);
        if (it == known.end()) continue;
        after = Normalized(it->second.second * it->second.first.inverse() * before);
        break;
      }
    }
    known[number] = {before, after};
    if (Moves(before, after, tolerance)) outcome.moves.push_back({number, after});
  }
  return outcome;
}

}  // namespace strata
