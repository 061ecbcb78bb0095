#include "core/engine/ingest/upload_beside.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/engine/map/map_core.h"
#include "core/storage/outcome.h"

namespace strata {

UploadBeside::UploadBeside(std::unique_ptr<MapStorage> store,
                           const api::Call& call,
                           const ScanHeader& header)
    : store_(std::move(store)),
      call_(call),
      header_(header),
      draft_(header, MapCore::NextUpload()) {}

absl::StatusOr<std::unique_ptr<UploadBeside>> UploadBeside::Begin(std::unique_ptr<MapStorage> store,
                                                                  const api::Call& call,
                                                                  const ScanHeader& header) {
  auto upload = std::unique_ptr<UploadBeside>(new UploadBeside(std::move(store), call, header));
  if (!header.content_hash.empty()) {
    STRATA_RETURN_IF_ERROR(
        Annotate(upload->LookForPresent(), absl::StrCat("scan ", header.id.ToString())));
  }
  return upload;
}

absl::Status UploadBeside::LookForPresent() {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_->NewReader());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          reader->FindScan(header_.id, clock.epoch));
  if (!present.has_value()) return absl::OkStatus();
  const std::string& hash = present->scan.content_hash;
  if (hash != header_.content_hash) return absl::AlreadyExistsError("exists with other content");
  present_ = ScanAck{header_.id, present->scan.number, true, hash};
  return absl::OkStatus();
}

// Where a commit may still be under way that has made a scan of them, the next engine to have the
// map clears away what none has.
UploadBeside::~UploadBeside() {
  if (leave_ || draft_.staged() == 0) return;
  Guarded([this] {
    StorageWriter& writer = store_->writer();
    return writer.Commit(Durability::kRelaxed,
                         [&] { return writer.AbandonUpload(draft_.upload()); });
  }).IgnoreError();
}

std::uint64_t UploadBeside::points_held() const {
  return present_.has_value() ? header_.point_count : 0;
}

absl::Status UploadBeside::Write(const PointCloud& chunk) {
  if (failed_.ok()) failed_ = call_.stop.status();
  if (failed_.ok() && present_.has_value()) {
    failed_ = absl::InvalidArgumentError("every point is there; finish the upload");
  }
  if (failed_.ok()) failed_ = Take(chunk);
  return Annotate(failed_, absl::StrCat("scan ", header_.id.ToString()));
}

absl::Status UploadBeside::Take(const PointCloud& chunk) {
  if (chunk.size() == 0) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(draft_.Check(chunk));
  STRATA_RETURN_IF_ERROR(draft_.Add(chunk));
  if (draft_.waiting_bytes() < kStageBytes) return absl::OkStatus();
  StorageWriter& writer = store_->writer();
  STRATA_RETURN_IF_ERROR(
      writer.Commit(Durability::kRelaxed, [&] { return draft_.PutPieces(writer); }));
  draft_.Staged();
  return absl::OkStatus();
}

absl::StatusOr<ScanAck> UploadBeside::Commit() {
  STRATA_RETURN_IF_ERROR(draft_.Seal());
  STRATA_RETURN_IF_ERROR(draft_.CheckWhole());
  StorageWriter& writer = store_->writer();
  const auto has_room = [] { return absl::OkStatus(); };  // PutScan() asks
  ScanAck ack;
  const absl::Status done = writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(ack, draft_.Commit(writer, has_room));
    return absl::OkStatus();
  });
  leave_ = done.ok() || IsOutcomeUnknown(done);
  STRATA_RETURN_IF_ERROR(done);
  return ack;
}

absl::StatusOr<ScanAck> UploadBeside::Finish() {
  const std::string what = absl::StrCat("scan ", header_.id.ToString());
  STRATA_RETURN_IF_ERROR(Annotate(failed_, what));
  STRATA_RETURN_IF_ERROR(call_.stop.status());
  if (present_.has_value()) return *present_;
  absl::StatusOr<ScanAck> ack = Commit();
  failed_ = ack.ok() ? absl::FailedPreconditionError("upload is finished") : ack.status();
  if (!ack.ok()) return Annotate(ack.status(), what);
  return ack;
}

}  // namespace strata
