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

absl::StatusOr<ScanReceiver> ScanReceiver::Begin(api::Database& db,
                                                 const api::Call& call,
                                                 const v1::ScanStart& start) {
  STRATA_ASSIGN_OR_RETURN(ScanHeader header, AtTheDoor(translate::FromProto(start.header())));
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<api::ScanUpload> upload,
                          db.scans().Upload(call, start.map(), header));
  return ScanReceiver(std::move(header), std::move(upload), start.resume());
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
