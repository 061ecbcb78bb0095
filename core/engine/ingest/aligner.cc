#include "core/engine/ingest/aligner.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/matching.h"
#include "core/registration/neighbours.h"

namespace strata {
namespace {

// A match to many scans at once is recorded as constraints to the nearest few, which share its
// information: more would repeat the same measurement.
constexpr std::size_t kMaxConstraints = 3;

// The first scan of a trajectory is looked for in so many parts of the map.
constexpr std::size_t kPartsTried = 3;

// Lost scans that a scan is matched to, one by one: nothing says where they are to each other.
constexpr std::size_t kLostTried = 3;

// So few scans of a pass are matched whatever their height: a ramp leads from one to the next.
constexpr std::size_t kJustBefore = 3;

// As many steps back the robot's word is judged by.
constexpr std::size_t kStepsJudged = 100;

bool OnOneStorey(const Pose& a, const Pose& b) {
  return std::abs(a.translation().z() - b.translation().z()) <= kSameStoreyM;
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
  indices_.clear();
  parts_.clear();
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> constraints,
                          reader.ListConstraints(epoch));
  std::map<ScanNumber, std::vector<ConstraintRecord>> to_earlier;  // of each scan
  for (const ConstraintRecord& record : constraints) {
    to_earlier[std::max(record.scan_i, record.scan_j)].push_back(record);
  }
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // no neighbour, but no reason to stop either
  return ForEachPosedScan(reader, query, epoch, [&](const PosedScan& posed) {
    Add(posed.scan, {posed.pose->T_map_scan, posed.pose->report, to_earlier[posed.scan.number]});
  });
}

void Aligner::Add(const ScanRecord& scan, const Placement& placement) {
  const ScanId& id = scan.header.id;
  const std::size_t segment = SegmentOf(id).value_or(scans_.size());
  std::map<std::uint64_t, std::size_t>& trajectory = trajectories_[id.trajectory];
  const bool is_first = trajectory.empty();
  trajectory[id.sequence] = scans_.size();
  indices_[scan.number] = scans_.size();
  scans_.push_back({scan.number,
                    scan.header.T_map_scan,
                    scan.header.sensor_origin.cast<double>(),
                    placement.report.aligned,
                    !is_first && !placement.report.aligned && placement.report.iterations > 0,
                    segment});
  poses_.push_back(placement.T_map_scan);
  Tie(scans_.size() - 1, placement.constraints);
}

void Aligner::Tie(std::size_t scan, const std::vector<ConstraintRecord>& constraints) {
  std::vector<std::size_t> others;
  for (const ConstraintRecord& record : constraints) {
    const auto i = indices_.find(record.scan_i);
    const auto j = indices_.find(record.scan_j);
    if (i == indices_.end() || j == indices_.end()) continue;  // a prior, or a damaged scan's
    others.push_back(i->second == scan ? j->second : i->second);
  }
  const auto is_lost = [&](std::size_t other) { return scans_[other].is_lost; };
  if (!others.empty() && std::ranges::all_of(others, is_lost)) {
    const std::size_t segment = std::ranges::min(others);
    others.push_back(scan);
    for (const std::size_t member : others) {
      scans_[member].is_lost = false;
      scans_[member].segment = segment;
    }
  }
  for (const std::size_t other : others) {
    if (!is_lost(other)) parts_.Join(scans_[other].segment, scans_[scan].segment);
  }
}

std::optional<std::size_t> Aligner::SegmentOf(const ScanId& id) const {
  const auto found = trajectories_.find(id.trajectory);
  if (found == trajectories_.end() || found->second.empty()) return std::nullopt;
  auto before = found->second.lower_bound(id.sequence);
  while (before != found->second.begin()) {
    const PlacedEntry& scan = scans_[(--before)->second];
    if (!scan.is_lost) return scan.segment;
  }
  return scans_[found->second.begin()->second].segment;
}

std::vector<std::size_t> Aligner::Apart(const ScanId& id, std::vector<std::size_t> scans) {
  const std::optional<std::size_t> segment = SegmentOf(id);
  if (!segment.has_value()) return scans;
  std::erase_if(scans,
                [&](std::size_t i) { return parts_.AreJoined(scans_[i].segment, *segment); });
  return scans;
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

std::optional<OdometryNoise> Aligner::NoiseBefore(const ScanId& id) const {
  const auto trajectory = trajectories_.find(id.trajectory);
  if (trajectory == trajectories_.end()) return std::nullopt;
  std::vector<std::optional<Pose>> errors;
  auto after = trajectory->second.lower_bound(id.sequence);
  if (after == trajectory->second.begin()) return std::nullopt;
  for (--after; after != trajectory->second.begin() && errors.size() < kStepsJudged; --after) {
    const std::size_t i = std::prev(after)->second, j = after->second;
    const Pose said = scans_[i].T_map_scan_uploaded.inverse() * scans_[j].T_map_scan_uploaded;
    const Pose measured = poses_[i].inverse() * poses_[j];
    errors.push_back(scans_[j].is_aligned ? std::optional<Pose>(said.inverse() * measured)
                                          : std::nullopt);
  }
  return EstimateOdometryNoise(errors);
}

void Aligner::Keep(ScanNumber number, const Features& features) {
  features_.Put(number, features, features->memory_bytes());
}

absl::StatusOr<Aligner::Features> Aligner::FeaturesOf(ScanNumber number,
                                                      StorageReader& reader,
                                                      ScanSource& source) {
  if (Features held = features_.Find(number); held != nullptr) return held;
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, reader.GetScan(number, 0));
  STRATA_ASSIGN_OR_RETURN(const MlsMap map, source.RegistrationMap(posed.scan));
  ScanFeatureOptions options = FeatureOptionsOf(posed.scan);
  options.sample_count = 0;  // others are matched to it, it is not matched itself
  STRATA_ASSIGN_OR_RETURN(ScanFeatures made, source.Features(posed.scan, map, options));
  const auto features = std::make_shared<const ScanFeatures>(std::move(made));
  Keep(number, features);
  return features;
}

std::vector<std::size_t> Aligner::OwnPass(const ScanId& id, const Pose& guess) {
  std::vector<std::size_t> pass;
  const std::optional<std::size_t> segment = SegmentOf(id);
  if (!segment.has_value()) return pass;
  const std::map<std::uint64_t, std::size_t>& trajectory = trajectories_.at(id.trajectory);
  const auto next = trajectory.lower_bound(id.sequence);
  const auto add = [&](std::size_t apart, std::size_t i) {
    if (!parts_.AreJoined(scans_[i].segment, *segment)) return;
    if (apart < kJustBefore || OnOneStorey(poses_[i], guess)) pass.push_back(i);
  };
  auto after = next;
  for (std::size_t k = 0; k < kOwnPass && after != trajectory.end(); ++k) {
    add(k, (after++)->second);
  }
  auto before = next;
  for (std::size_t k = 0; k < kOwnPass && before != trajectory.begin(); ++k) {
    add(k, (--before)->second);
  }
  std::sort(pass.begin(), pass.end());
  return pass;
}

std::vector<std::size_t> Aligner::LostBefore(const ScanId& id) const {
  std::vector<std::size_t> lost;
  const std::map<std::uint64_t, std::size_t>& trajectory = trajectories_.at(id.trajectory);
  auto before = trajectory.lower_bound(id.sequence);
  while (before != trajectory.begin() && lost.size() < kLostTried) {
    const std::size_t i = (--before)->second;
    if (!scans_[i].is_lost) break;
    lost.push_back(i);
  }
  return lost;
}

std::vector<std::size_t> Aligner::All() const {
  std::vector<std::size_t> all(scans_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::vector<std::size_t> Aligner::Believed(const std::vector<std::size_t>& scans) const {
  std::vector<std::size_t> believed;
  std::copy_if(scans.begin(), scans.end(), std::back_inserter(believed), [this](std::size_t i) {
    return !scans_[i].is_lost;
  });
  return believed.empty() ? scans : believed;
}

std::vector<std::size_t> Aligner::Around(const Pose& T_map_scan,
                                         const std::vector<std::size_t>& pass) const {
  std::vector<std::size_t> around = Believed(All());
  std::erase_if(around, [&](std::size_t i) {
    return !OnOneStorey(poses_[i], T_map_scan) && !std::binary_search(pass.begin(), pass.end(), i);
  });
  return around;
}

absl::StatusOr<Aligner::Neighbourhood> Aligner::NeighboursOf(const Pose& guess,
                                                             const std::vector<std::size_t>& among,
                                                             StorageReader& reader,
                                                             ScanSource& source) {
  std::vector<Pose> poses;
  for (const std::size_t i : among) poses.push_back(poses_[i]);
  Neighbourhood around;
  for (const std::size_t k : SelectNeighbours(poses, guess)) {
    const std::size_t i = among[k];
    // A scan whose data are damaged is no reason to refuse this one.
    absl::StatusOr<Features> features = FeaturesOf(scans_[i].number, reader, source);
    if (absl::IsDataLoss(features.status())) continue;
    STRATA_RETURN_IF_ERROR(features.status());
    around.held.push_back(*std::move(features));
    around.seen.push_back({around.held.back().get(), poses_[i], scans_[i].sensor_origin});
    around.indices.push_back(i);
  }
  return around;
}

std::vector<ConstraintRecord> Aligner::ConstraintsOf(ScanNumber number,
                                                     const Link& link,
                                                     std::vector<std::size_t> partners) const {
  NearestFirst(poses_, link.T_map_scan, partners);
  partners.resize(std::min(partners.size(), kMaxConstraints));
  std::vector<ConstraintRecord> records;
  for (const std::size_t i : partners) {
    ConstraintRecord record;
    record.scan_i = scans_[i].number;
    record.scan_j = number;
    record.constraint.T_i_j = Normalized(poses_[i].inverse() * link.T_map_scan);
    record.constraint.information = link.information / static_cast<double>(partners.size());
    record.constraint.origin = ConstraintOrigin::kIngest;
    record.constraint.note = link.report.message;
    records.push_back(std::move(record));
  }
  return records;
}

std::vector<std::vector<std::size_t>> Aligner::PartsAround(const Pose& guess) {
  const std::vector<std::size_t> believed = Believed(All());
  std::vector<Pose> poses;
  for (const std::size_t i : believed) poses.push_back(poses_[i]);
  std::vector<std::size_t> near;
  for (const std::size_t k : SelectNeighbours(poses, guess)) near.push_back(believed[k]);
  NearestFirst(poses_, guess, near);
  std::vector<std::size_t> roots;
  std::vector<std::vector<std::size_t>> parts;
  for (const std::size_t i : near) {
    const std::size_t root = parts_.Root(scans_[i].segment);
    if (parts.size() == kPartsTried || std::ranges::find(roots, root) != roots.end()) continue;
    roots.push_back(root);
    std::vector<std::size_t>& part = parts.emplace_back();
    std::ranges::copy_if(believed, std::back_inserter(part), [&](std::size_t other) {
      return parts_.Root(scans_[other].segment) == root;
    });
  }
  return parts;
}

absl::StatusOr<Placement> Aligner::PlaceAmongOthers(ScanNumber number,
                                                    const SeenScan& seen,
                                                    const Pose& guess,
                                                    StorageReader& reader,
                                                    ScanSource& source) {
  Placement placement;
  placement.T_map_scan = guess;
  placement.report.message = "no scan around to align to";
  bool is_tried = false;
  for (const std::vector<std::size_t>& part : PartsAround(guess)) {
    STRATA_ASSIGN_OR_RETURN(const Neighbourhood around, NeighboursOf(guess, part, reader, source));
    if (around.seen.empty()) continue;
    const Link link = LinkScan(seen, around.seen, guess, Nearness::kSaid);
    if (!is_tried || link.report.aligned) placement.report = link.report;
    is_tried = true;
    if (!link.report.aligned) continue;
    placement.T_map_scan = link.T_map_scan;
    placement.constraints = ConstraintsOf(number, link, around.indices);
    break;
  }
  return placement;
}

absl::StatusOr<Placement> Aligner::PlaceAmongLost(const ScanRecord& scan,
                                                  const SeenScan& seen,
                                                  Placement placement,
                                                  StorageReader& reader,
                                                  ScanSource& source) {
  const Pose guess = placement.T_map_scan;
  for (const std::size_t lost : LostBefore(scan.header.id)) {
    STRATA_ASSIGN_OR_RETURN(const Neighbourhood around,
                            NeighboursOf(guess, {lost}, reader, source));
    if (around.seen.empty()) continue;
    const Link link = LinkScan(seen, around.seen, guess, Nearness::kSamePass);
    if (!link.report.aligned) continue;
    placement.report = link.report;
    placement.T_map_scan = link.T_map_scan;
    placement.constraints = ConstraintsOf(scan.number, link, around.indices);
    break;
  }
  return placement;
}

absl::StatusOr<Placement> Aligner::Place(const ScanRecord& scan,
                                         const Features& own,
                                         StorageReader& reader,
                                         ScanSource& source) {
  Placement placement;
  placement.T_map_scan = scan.header.T_map_scan;
  Keep(scan.number, own);
  if (scan.header.alignment == Alignment::kOff) {
    placement.report.message = "alignment off: pose as uploaded";
    return placement;
  }
  const Pose guess = Guess(scan);
  placement.T_map_scan = guess;
  const SeenScan seen{own.get(), guess, scan.header.sensor_origin.cast<double>()};
  const std::vector<std::size_t> pass = Believed(OwnPass(scan.header.id, guess));
  STRATA_ASSIGN_OR_RETURN(const Neighbourhood around, NeighboursOf(guess, pass, reader, source));
  if (around.seen.empty()) return PlaceAmongOthers(scan.number, seen, guess, reader, source);
  const std::optional<OdometryNoise> noise = NoiseBefore(scan.header.id);
  const Link link = LinkScan(seen, around.seen, guess, Nearness::kSamePass, noise);
  placement.report = link.report;
  if (!link.report.aligned) {
    return PlaceAmongLost(scan, seen, std::move(placement), reader, source);
  }
  placement.T_map_scan = link.T_map_scan;
  placement.constraints = ConstraintsOf(scan.number, link, around.indices);
  const std::vector<std::size_t> level = Around(link.T_map_scan, pass);
  STRATA_ASSIGN_OR_RETURN(const Neighbourhood all,
                          NeighboursOf(link.T_map_scan, level, reader, source));
  if (all.indices == around.indices) return placement;
  const Link joint = AgreeingLink(seen, all.seen, link.T_map_scan, noise);
  if (joint.report.aligned) placement.T_map_scan = joint.T_map_scan;
  STRATA_ASSIGN_OR_RETURN(
      const Neighbourhood apart,
      NeighboursOf(placement.T_map_scan, Apart(scan.header.id, level), reader, source));
  if (apart.seen.empty()) return placement;
  const Link tie = VerifiedLink(seen, apart.seen, placement.T_map_scan);
  if (!tie.report.aligned) return placement;
  std::vector<ConstraintRecord> ties = ConstraintsOf(scan.number, tie, apart.indices);
  std::move(ties.begin(), ties.end(), std::back_inserter(placement.constraints));
  return placement;
}

}  // namespace strata
