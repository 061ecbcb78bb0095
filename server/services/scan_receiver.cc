#include "server/services/scan_receiver.h"

#include <utility>

#include "absl/strings/str_cat.h"

#include "core/api/chunk_check.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"
#include "server/rpc/request.h"

namespace strata::server {
namespace {

constexpr std::uint64_t kStagedBytes = 1 << 20;

std::uint64_t PointBytes(const v1::ScanHeader& header) {
  return 12 + (header.has_intensity() ? 4 : 0) + (header.has_colour() ? 3 : 0) +
         (header.has_label() ? 2 : 0);
}

std::uint64_t PieceBytes(const v1::ScanHeader& header) {
  return PointBytes(header) *
         std::min<std::uint64_t>(header.point_count(), api::kMaxPointsPerChunk);
}

// What a map keeps of a scan that comes in: the points of the piece under way, and pieces that wait
// until it is worth while to put them to disk.
std::size_t BytesOnTheWay(const v1::ScanHeader& header) {
  const std::uint64_t points = std::min(header.point_count(), kStagedBytes);
  return static_cast<std::size_t>(PieceBytes(header) +
                                  std::min(kStagedBytes, PointBytes(header) * points));
}

}  // namespace

absl::Status HoldChunk(const v1::ScanHeader& header, Booking& memory) {
  constexpr std::uint64_t kOverheadBytes = 1024;  // of a message and its columns
  const auto bytes = static_cast<std::size_t>(PieceBytes(header) + kOverheadBytes);
  return bytes > memory.bytes() ? memory.Resize(bytes) : absl::OkStatus();
}

absl::StatusOr<ScanReceiver> ScanReceiver::Begin(api::Database& db,
                                                 const api::Call& call,
                                                 const v1::ScanStart& start,
                                                 Booking memory) {
  STRATA_ASSIGN_OR_RETURN(ScanHeader header, AtTheDoor(translate::FromProto(start.header())));
  STRATA_RETURN_IF_ERROR(memory.Resize(BytesOnTheWay(start.header())));
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<api::ScanUpload> upload,
                          db.scans().Upload(call, start.map(), header));
  return ScanReceiver(std::move(header), std::move(memory), std::move(upload), start.resume());
}

absl::Status ScanReceiver::Add(const v1::PointChunk& chunk) {
  const std::string where = absl::StrCat("scan ", id().ToString());
  absl::StatusOr<PointCloud> cloud = translate::FromProto(chunk);
  if (!cloud.ok()) return AtTheDoor(Annotate(cloud.status(), where));
  STRATA_RETURN_IF_ERROR(AtTheDoor(Annotate(api::CheckChunk(*cloud, header_, received_), where)));
  const std::uint64_t first = received_;
  received_ += cloud->size();
  if (received_ <= held_) return absl::OkStatus();
  if (first >= held_) return upload_->Write(*cloud);
  return upload_->Write(SliceOf(*cloud, held_ - first, cloud->size()));
}

absl::StatusOr<ScanAck> ScanReceiver::Finish() {
  if (!complete()) {
    return AtTheDoor(
        absl::InvalidArgumentError(absl::StrCat("scan ",
                                                id().ToString(),
                                                ": ",
                                                received_,
                                                " points arrived, the header announced ",
                                                header_.point_count)));
  }
  return upload_->Finish();
}

}  // namespace strata::server
