#include "core/engine/truth_check.h"

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/codec/point_codec.h"
#include "core/common/status.h"
#include "core/engine/local_map_codec.h"
#include "core/engine/scan_hash.h"
#include "core/geometry/pose.h"

namespace strata {

absl::Status TruthCheck::CheckPoints(StorageReader& reader, const ScanRecord& scan) {
  ScanHasher hasher;
  std::uint64_t points = 0;
  for (std::uint32_t ordinal = 0; ordinal < scan.chunks; ++ordinal) {
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetChunk(scan.upload, ordinal));
    const absl::StatusOr<PointCloud> piece = DecodePoints(bytes);
    if (!piece.ok()) return Annotate(piece.status(), absl::StrCat("piece ", ordinal));
    hasher.Add(*piece);
    points += piece->size();
    ++pieces_;
  }
  if (points != scan.header.point_count) {
    return absl::DataLossError(
        absl::StrCat(points, " points instead of ", scan.header.point_count));
  }
  if (hasher.Digest(scan.header) != scan.content_hash) {
    return absl::DataLossError("points or header are not those that were uploaded");
  }
  return absl::OkStatus();
}

absl::Status TruthCheck::CheckScan(StorageReader& reader, const PosedScan& posed) {
  const ScanRecord& scan = posed.scan;
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(scan.header));
  if (posed.pose.has_value()) STRATA_RETURN_IF_ERROR(ValidatePose(posed.pose->T_map_scan));
  if (scan.state == ScanState::kIntegrated && !posed.pose.has_value()) {
    return absl::DataLossError("integrated without a pose");
  }
  if (scan.has_points) return CheckPoints(reader, scan);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetLocalMap(scan.number));
  return DecodeLocalMap(bytes, core_.info().parameters.mls).status();
}

absl::Status TruthCheck::Run(Report report) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader->GetScanTotals());
  ScanQuery query;
  query.limit = 1;  // one at a time: a damaged header must not hide the others
  const std::uint64_t epoch = core_.snapshots().current().epoch;
  while (scans_ < totals.scans) {
    const double share = static_cast<double>(scans_) / static_cast<double>(totals.scans);
    STRATA_RETURN_IF_ERROR(context_.Progress(0.4 * share, "checking scans"));
    const absl::StatusOr<std::vector<PosedScan>> page = reader->ListScans(query, epoch);
    if (absl::IsDataLoss(page.status())) {
      report(std::string(page.status().message()));
      return absl::OkStatus();
    }
    STRATA_RETURN_IF_ERROR(page.status());
    if (page->empty()) break;
    query.after = page->front().scan.number;
    ++scans_;
    const absl::Status sound = CheckScan(*reader, page->front());
    if (!sound.ok()) {
      report(absl::StrCat("scan ", page->front().scan.header.id.ToString(), ": ", sound.message()));
    }
  }
  const absl::Status constraints = reader->ListConstraints().status();
  if (absl::IsDataLoss(constraints)) {
    report(std::string(constraints.message()));
    return absl::OkStatus();
  }
  return constraints;
}

}  // namespace strata
