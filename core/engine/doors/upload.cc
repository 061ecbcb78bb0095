#include "core/engine/doors/upload.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/storage/storage.h"

namespace strata {

absl::StatusOr<std::unique_ptr<EngineUpload>> EngineUpload::Begin(std::shared_ptr<Map> map,
                                                                  const api::Call& call,
                                                                  const ScanHeader& header) {
  auto upload = std::unique_ptr<EngineUpload>(new EngineUpload(std::move(map), call, header));
  STRATA_RETURN_IF_ERROR(
      Annotate(upload->Open(header), absl::StrCat("scan ", header.id.ToString())));
  return upload;
}

absl::Status EngineUpload::Open(const ScanHeader& header) {
  // Waits for what an earlier stream of the scan is doing, so that its commit is seen.
  STRATA_ASSIGN_OR_RETURN(ticket_, intake_->Take());
  if (!header.content_hash.empty()) STRATA_RETURN_IF_ERROR(LookForPresent(header));
  if (present_.has_value()) return absl::OkStatus();
  held_ = intake_->points();
  return map_->CheckRoomForPending();
}

absl::Status EngineUpload::LookForPresent(const ScanHeader& header) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map_->core().Reader());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          reader->FindScan(header.id, clock.epoch));
  if (!present.has_value()) return absl::OkStatus();
  const std::string& hash = present->scan.content_hash;
  if (hash != header.content_hash) return absl::AlreadyExistsError("exists with other content");
  present_ = ScanAck{header.id, present->scan.number, true, hash};
  held_ = header.point_count;
  return absl::OkStatus();
}

// What there is no memory to keep is sent again.
EngineUpload::~EngineUpload() {
  Guarded([this] {
    map_->uploads().Release(std::move(intake_), ticket_);
    return absl::OkStatus();
  }).IgnoreError();
}

absl::Status EngineUpload::Write(const PointCloud& chunk) {
  if (failed_.ok()) failed_ = call_.stop.status();
  if (failed_.ok() && present_.has_value()) {
    failed_ = absl::InvalidArgumentError("every point is there; finish the upload");
  }
  if (failed_.ok()) failed_ = intake_->Write(ticket_, call_.stop, chunk);
  return Annotate(failed_, absl::StrCat("scan ", id_.ToString()));
}

absl::StatusOr<ScanAck> EngineUpload::Finish() {
  const std::string what = absl::StrCat("scan ", id_.ToString());
  STRATA_RETURN_IF_ERROR(Annotate(failed_, what));
  STRATA_RETURN_IF_ERROR(call_.stop.status());
  if (present_.has_value()) return *present_;
  absl::StatusOr<ScanAck> ack = intake_->Finish(
      ticket_,
      call_.stop,
      [this] { return map_->CheckRoomForPending(); },
      [this](ScanNumber number) { map_->ScanCommitted(number); });
  if (!ack.ok()) return Annotate(ack.status(), what);
  return ack;
}

}  // namespace strata
