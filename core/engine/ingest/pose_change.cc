#include "core/engine/ingest/pose_change.h"

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"

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
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(
      reader, query, epoch, [&](PosedScan posed) { change.scans_.push_back(std::move(posed)); }));
  change.partners_.resize(change.scans_.size());
  std::map<ScanNumber, std::size_t> index;
  std::map<std::string, std::map<std::uint64_t, std::size_t>> trajectories;
  for (std::size_t k = 0; k < change.scans_.size(); ++k) {
    const ScanRecord& scan = change.scans_[k].scan;
    index[scan.number] = k;
    trajectories[scan.header.id.trajectory][scan.header.id.sequence] = k;
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> constraints,
                          reader.ListConstraints(epoch));
  for (const ConstraintRecord& record : constraints) {
    const auto i = index.find(record.scan_i);
    const auto j = index.find(record.scan_j);
    if (record.constraint.is_prior() || i == index.end() || j == index.end()) continue;
    change.partners_[i->second].held.push_back(j->second);
    change.partners_[j->second].held.push_back(i->second);
  }
  for (const auto& [name, trajectory] : trajectories) {
    for (auto scan = trajectory.begin(); std::next(scan) != trajectory.end(); ++scan) {
      const auto [one, other] = std::pair(scan->second, std::next(scan)->second);
      change.partners_[one].beside.push_back(other);
      change.partners_[other].beside.push_back(one);
    }
  }
  return change;
}

std::optional<std::size_t> PoseChange::NearestOf(
    std::size_t scan,
    const std::vector<std::size_t>& partners,
    const std::vector<std::optional<Pose>>& after) const {
  const Eigen::Vector3d place = scans_[scan].pose->T_map_scan.translation();
  std::optional<std::size_t> nearest;
  double least = 0.0;
  for (const std::size_t partner : partners) {
    if (!after[partner].has_value()) continue;
    const double distance = (scans_[partner].pose->T_map_scan.translation() - place).squaredNorm();
    if (!nearest.has_value() || distance < least || (distance == least && partner < *nearest)) {
      nearest = partner;
      least = distance;
    }
  }
  return nearest;
}

std::vector<std::optional<Pose>> PoseChange::Carry() const {
  std::vector<std::optional<Pose>> after(scans_.size());
  std::set<std::size_t> front;  // that the last step reached
  for (std::size_t k = 0; k < scans_.size(); ++k) {
    const auto decided = decided_.find(scans_[k].scan.number);
    if (decided == decided_.end()) continue;
    after[k] = decided->second;
    front.insert(k);
  }
  while (!front.empty()) {
    std::set<std::size_t> reached;
    for (const std::size_t k : front) {
      for (const auto* partners : {&partners_[k].held, &partners_[k].beside}) {
        for (const std::size_t partner : *partners) {
          if (!after[partner].has_value()) reached.insert(partner);
        }
      }
    }
    std::map<std::size_t, Pose> poses;  // none of them carries another one of this step
    for (const std::size_t k : reached) {
      std::optional<std::size_t> by = NearestOf(k, partners_[k].held, after);
      if (!by.has_value()) by = NearestOf(k, partners_[k].beside, after);
      const Pose T_by_scan = scans_[*by].pose->T_map_scan.inverse() * scans_[k].pose->T_map_scan;
      poses[k] = Normalized(*after[*by] * T_by_scan);
    }
    for (const auto& [k, pose] : poses) after[k] = pose;
    front = std::move(reached);
  }
  return after;
}

PoseChange::Outcome PoseChange::Resolve(const MoveTolerance& tolerance) const {
  Outcome outcome;
  const std::vector<std::optional<Pose>> after = Carry();
  for (std::size_t k = 0; k < scans_.size(); ++k) {
    if (!after[k].has_value()) continue;
    const ScanNumber number = scans_[k].scan.number;
    if (!decided_.contains(number)) ++outcome.carried;
    if (Moves(scans_[k].pose->T_map_scan, *after[k], tolerance)) {
      outcome.moves.push_back({number, *after[k]});
    }
  }
  return outcome;
}

}  // namespace strata
