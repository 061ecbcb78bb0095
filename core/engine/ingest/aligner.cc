#include "core/engine/ingest/aligner.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/matching.h"
#include "core/registration/mls_registration.h"
#include "core/registration/neighbours.h"

namespace strata {
namespace {

// A match to many scans at once is recorded as constraints to the nearest few, which share its
// information: more would repeat the same measurement.
constexpr std::size_t kMaxConstraints = 3;

bool Accepted(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kMaxIterations ||
         termination == Termination::kDegenerate;
}

AlignmentReport ReportOf(const RegistrationResult& match) {
  AlignmentReport report;
  report.aligned = Accepted(match.termination);
  report.message = std::string(ToString(match.termination));
  report.overlap = match.overlap;
  report.rms_m = match.rms_m;
  report.iterations = static_cast<std::uint32_t>(match.iterations);
  return report;
}

void NearestFirst(const std::vector<Pose>& poses,
                  const Pose& place,
                  std::vector<std::size_t>& neighbours) {
  const auto distance = [&](std::size_t i) {
    return (poses[i].translation() - place.translation()).squaredNorm();
  };
  std::stable_sort(neighbours.begin(), neighbours.end(), [&](std::size_t a, std::size_t b) {
    return distance(a) < distance(b);
  });
}

}  // namespace

absl::Status Aligner::Load(StorageReader& reader, std::uint64_t epoch) {
  scans_.clear();
  poses_.clear();
  trajectories_.clear();
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // no neighbour, but no reason to stop either
  return ForEachPosedScan(reader, query, epoch, [&](const PosedScan& posed) {
    Add(posed.scan, posed.pose->T_map_scan);
  });
}

void Aligner::Add(const ScanRecord& scan, const Pose& T_map_scan) {
  const ScanId& id = scan.header.id;
  trajectories_[id.trajectory][id.sequence] = scans_.size();
  scans_.push_back({scan.number, scan.header.T_map_scan});
  poses_.push_back(T_map_scan);
}

Pose Aligner::Guess(const ScanRecord& scan) const {
  const ScanHeader& header = scan.header;
  const auto trajectory = trajectories_.find(header.id.trajectory);
  if (trajectory == trajectories_.end()) return header.T_map_scan;
  const auto next = trajectory->second.lower_bound(header.id.sequence);
  if (next == trajectory->second.begin()) return header.T_map_scan;
  const std::size_t predecessor = std::prev(next)->second;
  return Normalized(poses_[predecessor] * scans_[predecessor].T_map_scan_uploaded.inverse() *
                    header.T_map_scan);
}

Aligner::Features Aligner::Keep(const ScanRecord& scan, const MlsMap& local_map, int samples) {
  ScanFeatureOptions options = FeatureOptionsOf(scan);
  options.sample_count = samples;
  auto features = std::make_shared<const ScanFeatures>(ScanFeatures::FromMap(local_map, options));
  features_.Put(scan.number, features, features->memory_bytes());
  return features;
}

absl::StatusOr<Aligner::Features> Aligner::FeaturesOf(ScanNumber number,
                                                      StorageReader& reader,
                                                      ScanSource& source) {
  if (Features held = features_.Find(number); held != nullptr) return held;
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, reader.GetScan(number, 0));
  STRATA_ASSIGN_OR_RETURN(const MlsMap local_map, source.LocalMap(posed.scan));
  return Keep(posed.scan, local_map, 0);
}

absl::StatusOr<Aligner::Neighbourhood> Aligner::NeighboursOf(const Pose& guess,
                                                             StorageReader& reader,
                                                             ScanSource& source) {
  Neighbourhood around;
  for (const std::size_t i : SelectNeighbours(poses_, guess)) {
    // A scan whose data are damaged is no reason to refuse this one.
    absl::StatusOr<Features> features = FeaturesOf(scans_[i].number, reader, source);
    if (absl::IsDataLoss(features.status())) continue;
    STRATA_RETURN_IF_ERROR(features.status());
    around.held.push_back(*std::move(features));
    around.placed.push_back({around.held.back().get(), poses_[i]});
    around.indices.push_back(i);
  }
  return around;
}

std::vector<ConstraintRecord> Aligner::ConstraintsOf(ScanNumber number,
                                                     const Placement& placement,
                                                     const Matrix6d& information,
                                                     std::vector<std::size_t> partners) const {
  NearestFirst(poses_, placement.T_map_scan, partners);
  partners.resize(std::min(partners.size(), kMaxConstraints));
  std::vector<ConstraintRecord> records;
  for (const std::size_t i : partners) {
    ConstraintRecord record;
    record.scan_i = scans_[i].number;
    record.scan_j = number;
    record.constraint.T_i_j = Normalized(poses_[i].inverse() * placement.T_map_scan);
    record.constraint.information = information / static_cast<double>(partners.size());
    record.constraint.origin = ConstraintOrigin::kIngest;
    record.constraint.note = placement.report.message;
    records.push_back(std::move(record));
  }
  return records;
}

absl::StatusOr<Placement> Aligner::Place(const ScanRecord& scan,
                                         const MlsMap& local_map,
                                         StorageReader& reader,
                                         ScanSource& source) {
  Placement placement;
  placement.T_map_scan = scan.header.T_map_scan;
  const Features own = Keep(scan, local_map, FeatureOptionsOf(scan).sample_count);
  if (scan.header.alignment == Alignment::kOff) {
    placement.report.message = "alignment off: pose as uploaded";
    return placement;
  }
  const Pose guess = Guess(scan);
  placement.T_map_scan = guess;
  STRATA_ASSIGN_OR_RETURN(const Neighbourhood around, NeighboursOf(guess, reader, source));
  if (around.placed.empty()) {
    placement.report.message = "no scan around to align to";
    return placement;
  }
  const RegistrationTarget target(around.placed, TargetOptions{.centre = guess.translation()});
  const RegistrationResult match = RegisterScan(*own, target, guess, EngineRegistrationOptions());
  placement.report = ReportOf(match);
  if (!placement.report.aligned) return placement;
  placement.T_map_scan = Normalized(match.T_target_source);
  placement.constraints = ConstraintsOf(scan.number, placement, match.information, around.indices);
  return placement;
}

}  // namespace strata
