#include "core/storage/rows.h"

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/storage/records.h"
#include "core/storage/row.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

absl::StatusOr<ScanRecord> ReadScan(const Row& row) {
  ScanRecord scan;
  scan.number = row.Unsigned(0);
  const ScanId id{row.Text(1), row.Unsigned(2)};
  absl::StatusOr<ScanHeader> header = DecodeScanHeader(id, row.Bytes(3));
  if (!header.ok()) return Annotate(header.status(), absl::StrCat("scan ", id.ToString()));
  scan.header = *header;
  scan.state = static_cast<ScanState>(row.Int(4));
  scan.upload = row.Unsigned(5);
  scan.chunks = static_cast<std::uint32_t>(row.Int(6));
  scan.has_points = row.Int(7) != 0;
  scan.point_bytes = row.Unsigned(8);
  if (row.Int(9) != 0) {
    scan.box_scan.min() = Eigen::Vector3d(row.Real(10), row.Real(11), row.Real(12)).cast<float>();
    scan.box_scan.max() = Eigen::Vector3d(row.Real(13), row.Real(14), row.Real(15)).cast<float>();
  }
  scan.content_hash = row.Text(16);
  scan.message = row.Text(17);
  scan.person_labels = row.Int(27) != 0;
  scan.label_model = row.Unsigned(28);
  scan.faded_points = row.Unsigned(29);
  return scan;
}

absl::StatusOr<PoseRecord> ReadPose(ScanNumber scan, const Row& row) {
  PoseRecord record;
  record.scan = scan;
  record.epoch = row.Unsigned(19);
  STRATA_ASSIGN_OR_RETURN(record.T_map_scan, DecodePose(row.Bytes(20)));
  record.origin = static_cast<PoseOrigin>(row.Int(21));
  record.report.aligned = row.Int(22) != 0;
  record.report.message = row.Text(23);
  record.report.overlap = row.Real(24);
  record.report.rms_m = row.Real(25);
  record.report.iterations = static_cast<std::uint32_t>(row.Int(26));
  return record;
}

}  // namespace

absl::StatusOr<PosedScan> ReadPosedScan(const Row& row) {
  PosedScan posed;
  STRATA_ASSIGN_OR_RETURN(posed.scan, ReadScan(row));
  if (row.Int(18) == 0) return posed;
  absl::StatusOr<PoseRecord> pose = ReadPose(posed.scan.number, row);
  if (!pose.ok()) {
    return Annotate(pose.status(), absl::StrCat("scan ", posed.scan.header.id.ToString()));
  }
  posed.pose = *pose;
  return posed;
}

RobotProfile ReadProfile(const Row& row, int first_column) {
  RobotProfile profile;
  profile.radius_m = row.Real(first_column);
  profile.height_m = row.Real(first_column + 1);
  profile.max_step_m = row.Real(first_column + 2);
  profile.max_slope_rad = row.Real(first_column + 3);
  profile.max_gap_m = row.Real(first_column + 4);
  profile.max_roughness_m = row.Real(first_column + 5);
  return profile;
}

absl::StatusOr<MapInfo> ReadMapInfo(const Row& row) {
  MapInfo info;
  info.created = absl::FromUnixMicros(row.Int(0));
  info.parameters.mls = {row.Real(1), row.Real(2), row.Real(3)};
  info.parameters.sensor = {row.Real(4), row.Real(5), row.Real(6), row.Real(7)};
  info.parameters.keep_points = row.Int(8) != 0;
  if (row.Int(9) != 0) info.parameters.origin = {row.Real(10), row.Real(11), row.Real(12)};
  info.parameters.default_profile = ReadProfile(row, 13);
  info.parameters.fade_after = static_cast<std::uint32_t>(row.Int(19));
  if (const absl::Status valid = ValidateMapParameters(info.parameters); !valid.ok()) {
    return absl::DataLossError(absl::StrCat("store: ", valid.message()));
  }
  return info;
}

absl::Status CheckScanColumns(const Row& row) {
  STRATA_ASSIGN_OR_RETURN(const ScanHeader header,
                          DecodeScanHeader({row.Text(0), row.Unsigned(1)}, row.Bytes(2)));
  if (row.Unsigned(3) != header.point_count) {
    return absl::DataLossError(
        absl::StrCat("counted with ", row.Unsigned(3), " points instead of ", header.point_count));
  }
  const std::int64_t time_us = absl::ToUnixMicros(header.time);
  if (row.Int(4) == time_us) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("found by time ", row.Int(4), " us instead of ", time_us));
}

JobInfo ReadJob(const Row& row) {
  JobInfo job;
  job.id = row.Unsigned(0);
  job.kind = row.Text(1);
  job.state = static_cast<JobState>(row.Int(2));
  job.progress = row.Real(3);
  job.phase = row.Text(4);
  job.message = row.Text(5);
  job.created = absl::FromUnixMicros(row.Int(6));
  job.updated = absl::FromUnixMicros(row.Int(7));
  return job;
}

absl::StatusOr<ConstraintRecord> ReadConstraint(const Row& row) {
  ConstraintRecord record;
  Constraint& constraint = record.constraint;
  constraint.id = row.Unsigned(0);
  record.scan_i = row.Unsigned(1);
  record.scan_j = row.Unsigned(2);
  const std::string what = absl::StrCat("constraint ", constraint.id);
  absl::StatusOr<Pose> pose = DecodePose(row.Bytes(3));
  if (!pose.ok()) return Annotate(pose.status(), what);
  constraint.T_i_j = *pose;
  absl::StatusOr<Matrix6d> information = DecodeMatrix6(row.Bytes(4));
  if (!information.ok()) return Annotate(information.status(), what);
  constraint.information = *information;
  constraint.origin = static_cast<ConstraintOrigin>(row.Int(5));
  constraint.enabled = row.Int(6) != 0;
  constraint.note = row.Text(7);
  constraint.i = {row.Text(8), row.Unsigned(9)};
  constraint.j = {row.Text(10), row.Unsigned(11)};
  constraint.may_be_false = row.Int(12) != 0;
  return record;
}

PlaneRecord ReadPlane(const Row& row) {
  PlaneRecord record;
  GlobalPlane& plane = record.plane;
  plane.id = row.Unsigned(0);
  plane.plane.normal = {row.Real(1), row.Real(2), row.Real(3)};
  plane.plane.distance = row.Real(4);
  plane.kind = static_cast<PlaneKind>(row.Int(5));
  plane.from_edges = row.Int(6) != 0;
  plane.enabled = row.Int(7) != 0;
  plane.note = row.Text(8);
  return record;
}

void AddSupport(const Row& row, PlaneRecord& plane) {
  plane.scans.push_back(row.Unsigned(0));
  plane.plane.supports.push_back({{row.Text(3), row.Unsigned(4)}, row.Real(1), row.Real(2)});
}

ClassifierInfo ReadClassifier(const Row& row) {
  ClassifierInfo info;
  info.id = row.Unsigned(0);
  info.name = row.Text(1);
  info.created = absl::FromUnixMicros(row.Int(2));
  info.job = row.Unsigned(3);
  info.description = row.Text(4);
  info.bytes = row.Unsigned(5);
  return info;
}

TileKey ReadTileKey(const Row& row) {
  return {static_cast<std::int32_t>(row.Int(0)),
          static_cast<std::int32_t>(row.Int(1)),
          static_cast<std::int32_t>(row.Int(2))};
}

MlsTileRow ReadMlsTile(const Row& row) {
  MlsTileRow tile;
  tile.key = ReadTileKey(row);
  tile.version = row.Unsigned(3);
  tile.patches = row.Unsigned(4);
  tile.cells = row.Unsigned(5);
  tile.box.min() = {row.Real(6), row.Real(7), row.Real(8)};
  tile.box.max() = {row.Real(9), row.Real(10), row.Real(11)};
  tile.spread_weight = row.Real(12);
  tile.spread_sum = row.Real(13);
  tile.digest = row.Text(14);
  return tile;
}

SurfaceTileRow ReadSurfaceTile(const Row& row) {
  SurfaceTileRow tile;
  tile.key = ReadTileKey(row);
  tile.version = row.Unsigned(3);
  tile.gone = row.Int(4) != 0;
  tile.patches = row.Unsigned(5);
  tile.size_bytes = row.Unsigned(6);
  return tile;
}

EpochInfo ReadEpoch(const Row& row) {
  EpochInfo info;
  info.epoch = row.Unsigned(0);
  info.created = absl::FromUnixMicros(row.Int(1));
  info.reason = row.Text(2);
  info.job = row.Unsigned(3);
  info.decided = row.Unsigned(4);
  info.current = info.epoch == row.Unsigned(5);
  info.kept = info.epoch >= row.Unsigned(6);
  return info;
}

UnfinishedUpload ReadUnfinishedUpload(const Row& row) {
  UnfinishedUpload upload;
  upload.upload = row.Unsigned(0);
  upload.id = {row.Text(1), row.Unsigned(2)};
  upload.content_hash = row.Text(3);
  upload.touched = absl::FromUnixMicros(row.Int(4));
  upload.chunks = static_cast<std::uint32_t>(row.Int(5));
  upload.bytes = row.Unsigned(6);
  return upload;
}

MapClass ReadMapClass(const Row& row) {
  const std::uint64_t rgb = row.Unsigned(2);
  const Colour colour = {static_cast<std::uint8_t>(rgb >> 16 & 0xFF),
                         static_cast<std::uint8_t>(rgb >> 8 & 0xFF),
                         static_cast<std::uint8_t>(rgb & 0xFF)};
  return {static_cast<std::uint16_t>(row.Int(0)), row.Text(1), colour};
}

std::uint32_t ColourToColumn(const Colour& colour) {
  return std::uint32_t{colour.r} << 16 | std::uint32_t{colour.g} << 8 | colour.b;
}

Attempt ReadAttempt(const Row& row) {
  return {{static_cast<WorkKind>(row.Int(0)), row.Unsigned(1)},
          static_cast<std::uint32_t>(row.Unsigned(2)),
          row.Int(3) != 0};
}

}  // namespace strata
