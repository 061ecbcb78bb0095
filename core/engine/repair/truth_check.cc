#include "core/engine/repair/truth_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/classification/classifier_codec.h"
#include "core/codec/local_map_codec.h"
#include "core/codec/point_codec.h"
#include "core/common/status.h"
#include "core/engine/scans/scan_labels.h"
#include "core/geometry/pose.h"
#include "core/world/constraint.h"
#include "core/world/epoch.h"
#include "core/world/map_class.h"
#include "core/world/robot_profile.h"
#include "core/world/scan_hash.h"

namespace strata {

// A damaged piece leaves the others to be looked at, but nothing to compare the whole with.
void TruthCheck::CheckPoints(StorageReader& reader, const ScanRecord& scan, Report report) {
  ScanHasher hasher;
  std::uint64_t points = 0;
  std::uint64_t point_bytes = 0;
  Eigen::AlignedBox3f box_scan;
  bool whole = true;
  for (std::uint32_t ordinal = 0; ordinal < scan.chunks; ++ordinal) {
    ++pieces_;
    const absl::StatusOr<std::string> bytes = reader.GetChunk(scan.upload, ordinal);
    const absl::StatusOr<PointCloud> piece = bytes.ok() ? DecodePoints(*bytes) : bytes.status();
    if (!piece.ok()) {
      report(absl::StrCat("piece ", ordinal, ": ", piece.status().message()));
      whole = false;
      continue;
    }
    hasher.Add(*piece);
    for (const Eigen::Vector3f& p : piece->points) {
      if (!std::isnan(p.x())) box_scan.extend(p);
    }
    points += piece->size();
    point_bytes += bytes->size();
  }
  if (!whole) return;
  if (point_bytes != scan.point_bytes) {
    report(absl::StrCat(point_bytes, " bytes of points instead of ", scan.point_bytes));
  }
  if (box_scan.min() != scan.box_scan.min() || box_scan.max() != scan.box_scan.max()) {
    report("the box is not that of the points");
  }
  if (points != scan.header.point_count) {
    report(absl::StrCat(points, " points instead of ", scan.header.point_count));
  } else if (!hasher.Matches(scan.header, scan.content_hash)) {
    report("points or header are not those that were uploaded");
  }
}

void TruthCheck::CheckLabels(StorageReader& reader, const ScanRecord& scan, Report report) {
  const std::pair<LabelOrigin, bool> columns[] = {{LabelOrigin::kPerson, scan.person_labels},
                                                  {LabelOrigin::kModel, scan.label_model != 0},
                                                  {LabelOrigin::kFaded, scan.faded_points != 0}};
  for (const auto& [origin, given] : columns) {
    const absl::StatusOr<std::uint64_t> count = CountLabels(reader, scan, origin);
    if (!count.ok()) {
      report(std::string(count.status().message()));
    } else if (const std::uint64_t expected = given ? scan.header.point_count : 0;
               *count != expected) {
      report(absl::StrCat(*count, " labels instead of ", expected));
    }
  }
}

void TruthCheck::CheckClassifiers(StorageReader& reader, Report report) {
  const absl::StatusOr<std::vector<ClassifierInfo>> classifiers = reader.ListClassifiers();
  if (!classifiers.ok()) return report(std::string(classifiers.status().message()));
  for (const ClassifierInfo& info : *classifiers) {
    const absl::StatusOr<std::string> bytes = reader.GetClassifier(info.id);
    const absl::Status sound = bytes.ok() ? DecodeClassifier(*bytes).status() : bytes.status();
    if (!sound.ok()) report(absl::StrCat("classifier ", info.name, ": ", sound.message()));
  }
}

void TruthCheck::CheckScan(StorageReader& reader, const PosedScan& posed, Report report) {
  const ScanRecord& scan = posed.scan;
  const auto check = [&](const absl::Status& sound) {
    if (!sound.ok()) report(std::string(sound.message()));
  };
  check(ValidateScanHeader(scan.header));
  if (scan.state < ScanState::kPending || scan.state > ScanState::kFailed) {
    report(absl::StrCat("state ", static_cast<int>(scan.state), " is none"));
  }
  check(reader.CheckScanRow(scan.number));
  if (posed.pose.has_value()) check(ValidatePose(posed.pose->T_map_scan));
  if (scan.state == ScanState::kIntegrated && !posed.pose.has_value()) {
    report("integrated without a pose");
  }
  if (scan.has_points) {
    CheckPoints(reader, scan, report);
    return CheckLabels(reader, scan, report);
  }
  const absl::StatusOr<std::string> bytes = reader.GetLocalMap(scan.number);
  check(bytes.ok() ? DecodeLocalMap(*bytes, core_.info().parameters.mls).status() : bytes.status());
}

// Nothing of these carries a checksum, but not every number makes sense.
absl::Status TruthCheck::CheckDecisions(StorageReader& reader, ScanNumber last, Report report) {
  const auto check = [&](const std::string& what, const absl::Status& sound) {
    if (!sound.ok()) report(absl::StrCat(what, ": ", sound.message()));
  };
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  if (clock.commit_sequence < std::max(last, clock.tile_version)) {
    report(absl::StrCat("the map's clock, ", clock.commit_sequence, ", is behind what it counted"));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs, reader.ListEpochs());
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    if (epochs[i].epoch == epochs.size() - i && epochs[i].current == (i == 0)) continue;
    report(absl::StrCat("epoch ", epochs[i].epoch, " of ", epochs.size(), ", now ", clock.epoch));
  }
  STRATA_ASSIGN_OR_RETURN(const auto profiles, reader.ListProfiles());
  for (const auto& [name, profile] : profiles) {
    check(absl::StrCat("profile ", name), ValidateRobotProfile(profile));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes, reader.ListClasses());
  for (const MapClass& each : classes) {
    check(absl::StrCat("class ", each.id), ValidateMapClass(each));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> constraints,
                          reader.ListConstraints(clock.epoch));
  for (const ConstraintRecord& record : constraints) {
    check(absl::StrCat("constraint ", record.constraint.id), ValidateConstraint(record.constraint));
  }
  return reader.ListPlanes(clock.epoch).status();
}

absl::Status TruthCheck::Run(Report report) {
  StorageReader& reader = *view_.readers.front();
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanNumber> numbers, reader.ListScanNumbers());
  for (const ScanNumber number : numbers) {
    const double share = static_cast<double>(scans_) / static_cast<double>(numbers.size());
    STRATA_RETURN_IF_ERROR(context_.Progress(0.4 * share, "checking scans"));
    ++scans_;
    const absl::StatusOr<PosedScan> posed = reader.GetScan(number, view_.clock.epoch);
    if (absl::IsDataLoss(posed.status())) {
      report(absl::StrCat("row ", number, ": ", posed.status().message()));
      continue;
    }
    STRATA_RETURN_IF_ERROR(posed.status());
    CheckScan(reader, *posed, [&](const std::string& what) {
      report(absl::StrCat("scan ", posed->scan.header.id.ToString(), ": ", what));
    });
  }
  CheckClassifiers(reader, report);
  const absl::Status decisions =
      CheckDecisions(reader, numbers.empty() ? 0 : numbers.back(), report);
  if (!absl::IsDataLoss(decisions)) return decisions;
  report(std::string(decisions.message()));
  return absl::OkStatus();
}

}  // namespace strata
