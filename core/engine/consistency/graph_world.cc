#include "core/engine/consistency/graph_world.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/posegraph/closures/closure_consistency.h"
#include "core/posegraph/information.h"

namespace strata {
namespace {

// A surface is level or upright within this of the vertical or the horizontal [rad].
constexpr double kStraightRad = 0.26;

PlaneKind KindOf(const Eigen::Vector3d& normal) {
  const double tilt = std::acos(std::min(1.0, std::abs(normal.z())));
  if (tilt < kStraightRad) return PlaneKind::kLevel;
  return tilt > M_PI_2 - kStraightRad ? PlaneKind::kWall : PlaneKind::kSloped;
}

// Errors of a match beside what its points' noise leaves, and how the two know each other better
// the nearer they are: part of the error repeats from match to match, so that chains drift.
constexpr double kMatchSigmaM = 0.01;
constexpr double kMatchSigmaRad = 0.001;

// What a match to one of `partners` at once, which share its information, says of the two.
Matrix6d MatchInformation(const Matrix6d& information, double partners, double way_m) {
  const DriftOptions drift;
  const double root = std::sqrt(way_m);
  return LoosenedInformation(
             partners * information,
             IsotropicInformation(std::hypot(kMatchSigmaRad, drift.drift_rad * root),
                                  std::hypot(kMatchSigmaM, drift.drift_m * root))) /
         partners;
}

// Errors of uploaded poses from scan to scan. Nobody says how good they are; they count only where
// nothing else does.
constexpr double kOdometrySigmaM = 0.05;
constexpr double kOdometrySigmaRad = 0.005;

}  // namespace

absl::Status GraphWorld::ReadScans(StorageReader& reader) {
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // FindDamagedRows() names them
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(reader, query, epoch_, [&](PosedScan posed) {
    nodes_[posed.scan.number] = scans_.size();
    poses_.push_back(posed.pose->T_map_scan);
    scans_.push_back(std::move(posed.scan));
  }));
  std::map<std::string, std::map<std::uint64_t, std::size_t>> by_name;
  for (std::size_t k = 0; k < scans_.size(); ++k) by_name[id(k).trajectory][id(k).sequence] = k;
  places_.resize(scans_.size());
  for (const auto& [name, sequence] : by_name) {
    std::vector<std::size_t>& trajectory = trajectories_.emplace_back();
    for (const auto& [number, node] : sequence) {
      places_[node] = {trajectories_.size() - 1, trajectory.size()};
      trajectory.push_back(node);
    }
  }
  return absl::OkStatus();
}

absl::Status GraphWorld::FindDamagedRows(StorageReader& reader, DamagedScans& damaged) const {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanNumber> numbers, reader.ListScanNumbers());
  for (const ScanNumber number : numbers) {
    if (nodes_.contains(number)) continue;
    const absl::Status read = reader.GetScan(number, epoch_).status();
    if (!damaged.LeaveOut(number, absl::StrCat("row ", number), read)) {
      STRATA_RETURN_IF_ERROR(read);
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<GraphWorld> GraphWorld::Read(MapCore& core, DamagedScans* damaged) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return Read(*reader, damaged);
}

absl::StatusOr<GraphWorld> GraphWorld::Read(StorageReader& reader, DamagedScans* damaged) {
  GraphWorld world;
  STRATA_RETURN_IF_ERROR(reader.Snapshot([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
    world.epoch_ = clock.epoch;
    STRATA_RETURN_IF_ERROR(world.ReadScans(reader));
    if (damaged != nullptr) STRATA_RETURN_IF_ERROR(world.FindDamagedRows(reader, *damaged));
    STRATA_ASSIGN_OR_RETURN(world.constraints_, reader.ListConstraints(clock.epoch));
    STRATA_ASSIGN_OR_RETURN(world.planes_, reader.ListPlanes(clock.epoch));
    return absl::OkStatus();
  }));
  std::erase_if(world.constraints_, [&world](const ConstraintRecord& record) {
    return !world.nodes_.contains(record.scan_j) ||
           (!record.constraint.is_prior() && !world.nodes_.contains(record.scan_i));
  });
  return world;
}

bool GraphWorld::SamePass(std::size_t a, std::size_t b) const {
  const auto [first, last] = std::minmax(places_[a].index, places_[b].index);
  return places_[a].trajectory == places_[b].trajectory && last - first < kPass;
}

RelativePoseTerm GraphWorld::Odometry(std::size_t i, std::size_t j) const {
  const Pose T_i_j =
      Normalized(scans_[i].header.T_map_scan.inverse() * scans_[j].header.T_map_scan);
  return {i, j, T_i_j, IsotropicInformation(kOdometrySigmaRad, kOdometrySigmaM)};
}

AlignmentProblem GraphWorld::Problem(const OptimizeSettings& settings) const {
  AlignmentProblem problem;
  problem.T_map_scan = poses_;
  problem.trajectories = trajectories_;
  std::vector<bool> held(scans_.size(), false);
  for (const ConstraintRecord& record : constraints_) {
    const Constraint& constraint = record.constraint;
    const std::size_t j = nodes_.at(record.scan_j);
    if (constraint.is_prior()) {
      if (constraint.enabled) {
        const bool may_be_false = constraint.may_be_false && settings.robust;
        problem.priors.push_back({j, constraint.T_i_j, constraint.information, may_be_false});
      }
      continue;
    }
    const std::size_t i = nodes_.at(record.scan_i);
    if (!constraint.enabled) {
      problem.excluded_pairs.emplace_back(i, j);
    } else if (constraint.origin == ConstraintOrigin::kPerson) {
      const bool may_be_false = constraint.may_be_false && settings.robust;
      problem.relative.push_back({i, j, constraint.T_i_j, constraint.information, may_be_false});
      if (!may_be_false) held[std::max(i, j)] = true;
    } else {
      const bool closure = constraint.origin == ConstraintOrigin::kOptimize;
      const bool doubtful =
          closure && settings.robust && !ClosureHolds(constraint.T_i_j, poses_[i], poses_[j]);
      ScanPair& pair = problem.pairs.emplace_back(ScanPair{i, j, doubtful});
      if (!closure) pair.measured = MeasuredPose{constraint.T_i_j, constraint.information};
      if (!closure) held[std::max(i, j)] = true;
    }
  }
  for (const std::vector<std::size_t>& trajectory : trajectories_) {
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      if (held[trajectory[k]]) continue;
      problem.pairs.push_back({trajectory[k - 1], trajectory[k]});
      // Nothing was found where it was looked for.
      if (scans_[trajectory[k]].header.alignment != Alignment::kOff) {
        problem.lost.push_back(trajectory[k]);
      }
    }
  }
  for (const std::vector<std::size_t>& trajectory : trajectories_) {
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      problem.odometry.push_back(Odometry(trajectory[k - 1], trajectory[k]));
    }
  }
  for (const PlaneRecord& record : planes_) {
    if (record.plane.enabled) continue;
    ExcludedPlane& excluded = problem.excluded_planes.emplace_back();
    excluded.plane_map = record.plane.plane;
    for (const ScanNumber scan : record.scans) {
      if (nodes_.contains(scan)) excluded.nodes.push_back(nodes_.at(scan));
    }
  }
  return problem;
}

MeasuredGraph GraphWorld::Measured(const OptimizeSettings& settings) const {
  const AlignmentProblem problem = Problem(settings);
  MeasuredGraph measured;
  PoseGraphProblem& graph = measured.graph;
  graph.T_map_scan = poses_;
  graph.relative = problem.relative;
  graph.priors = problem.priors;
  for (const RelativePoseTerm& term : problem.relative) {
    if (!term.may_be_false) measured.edges.push_back({term.i, term.j, term.information});
  }
  std::map<std::pair<std::size_t, std::size_t>, const ConstraintRecord*> recorded;
  std::map<ScanNumber, double> partners;  // that a scan was matched to at once
  for (const ConstraintRecord& record : constraints_) {
    if (record.constraint.is_prior()) continue;
    recorded[{nodes_.at(record.scan_i), nodes_.at(record.scan_j)}] = &record;
    if (record.constraint.origin == ConstraintOrigin::kIngest) partners[record.scan_j] += 1.0;
  }
  std::map<std::size_t, Matrix6d> information;  // of what was recorded as nodes came in
  for (const ScanPair& pair : problem.pairs) {
    RelativePoseTerm term{pair.i, pair.j};
    term.may_be_false = pair.may_be_false;
    const auto record = recorded.find({pair.i, pair.j});
    if (record != recorded.end()) {
      term.T_i_j = record->second->constraint.T_i_j;
      term.information = MatchInformation(record->second->constraint.information,
                                          std::max(1.0, partners[record->second->scan_j]),
                                          term.T_i_j.translation().norm());
      if (!term.may_be_false) {
        information.insert({pair.j, Matrix6d::Zero()}).first->second += term.information;
      }
    } else {
      term.T_i_j = poses_[pair.i].inverse() * poses_[pair.j];
      term.information = IsotropicInformation(pair.sigma_rad, pair.sigma_m);
    }
    measured.edges.push_back({term.i, term.j, term.information});
    graph.relative.push_back(std::move(term));
  }
  for (RelativePoseTerm odometry : problem.odometry) {
    const auto known = information.find(odometry.j);
    if (known == information.end()) continue;
    odometry.information = WhereLess(known->second, odometry.information, kLooseShare);
    if (!odometry.information.isZero()) graph.relative.push_back(odometry);
  }
  return measured;
}

PlaneRecord GraphWorld::RecordOf(const SharedPlane& plane) const {
  PlaneRecord record;
  record.plane.plane = plane.plane;
  record.plane.kind = KindOf(plane.plane.normal);
  record.plane.from_edges = plane.from_edges;
  for (const SharedPlane::View& view : plane.views) {
    record.scans.push_back(number(view.scan));
    record.plane.supports.push_back({id(view.scan), view.weight, view.rms_m});
  }
  return record;
}

std::vector<PlaneRecord> GraphWorld::DisabledPlanes() const {
  std::vector<PlaneRecord> disabled;
  for (const PlaneRecord& record : planes_) {
    if (!record.plane.enabled) disabled.push_back(record);
  }
  return disabled;
}

}  // namespace strata
