#include "core/storage/sqlite/scan_rows.h"

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/storage/records.h"
#include "core/storage/sqlite/database.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

absl::StatusOr<ScanRecord> ReadScan(const Statement& row) {
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

absl::StatusOr<PoseRecord> ReadPose(ScanNumber scan, const Statement& row) {
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

absl::StatusOr<PosedScan> ReadPosedScan(const Statement& statement) {
  PosedScan posed;
  STRATA_ASSIGN_OR_RETURN(posed.scan, ReadScan(statement));
  if (statement.Int(18) == 0) return posed;
  absl::StatusOr<PoseRecord> pose = ReadPose(posed.scan.number, statement);
  if (!pose.ok()) {
    return Annotate(pose.status(), absl::StrCat("scan ", posed.scan.header.id.ToString()));
  }
  posed.pose = *pose;
  return posed;
}

}  // namespace strata
