#include "client/sdk/remote_upload.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"

namespace strata::sdk {
namespace {

constexpr std::size_t kMaxKeptBytes = std::size_t{64} << 20;
// The server's word, in its initial metadata, that the points are welcome.
constexpr char kAcceptedKey[] = "x-upload-accepted";

}  // namespace

RemoteUpload::RemoteUpload(Connection& connection,
                           v1::Scans::Stub& stub,
                           const api::Call& call,
                           absl::string_view map,
                           const ScanHeader& header)
    : connection_(connection),
      stub_(stub),
      call_(call),
      header_(header),
      backoff_(connection.NewBackoff()) {
  start_.mutable_start()->set_map(std::string(map));
  *start_.mutable_start()->mutable_header() = translate::ToProto(header);
}

RemoteUpload::~RemoteUpload() {
  if (stream_ == nullptr) return;
  // A cancelled stream looks to the server like one that ended, and it may have every point; an
  // empty message is refused in its turn, whatever came before.
  stream_->writer->Write(v1::UploadScanRequest());
  stream_->writer->Finish();
}

absl::Status RemoteUpload::Open() { return Deliver(); }

absl::Status RemoteUpload::Write(const PointCloud& chunk) {
  if (chunk.points.empty()) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(Annotate(translate::CheckChunk(chunk, header_, points_),
                                  absl::StrCat("scan ", header_.id.ToString())));
  points_ += chunk.size();
  v1::UploadScanRequest& message = messages_.emplace_back();
  *message.mutable_chunk() = translate::ToProto(chunk);
  kept_bytes_ += message.ByteSizeLong();
  STRATA_RETURN_IF_ERROR(Deliver());
  if (kept_bytes_ > kMaxKeptBytes) {
    forgotten_ = true;
    messages_.clear();
    stream_->sent = 0;
  }
  return absl::OkStatus();
}

absl::StatusOr<ScanAck> RemoteUpload::Finish() {
  while (true) {
    absl::Status status = Advance();
    if (status.ok()) {
      stream_->writer->WritesDone();
      status = StatusOf(stream_->writer->Finish(), call_);
      const std::unique_ptr<Stream> ended = std::move(stream_);
      if (status.ok()) return translate::FromProto(ended->response.ack());
    }
    if (!MayRepeat(status)) return status;
  }
}

absl::Status RemoteUpload::Deliver() {
  while (true) {
    absl::Status status = Advance();
    if (status.ok() || !MayRepeat(status)) return status;
  }
}

absl::Status RemoteUpload::Advance() {
  if (stream_ == nullptr) {
    if (forgotten_) {
      return absl::AbortedError(
          absl::StrCat("scan ", header_.id.ToString(), ": its upload has ended; begin it again"));
    }
    STRATA_RETURN_IF_ERROR(OpenStream());
  }
  for (; stream_->sent < messages_.size(); ++stream_->sent) {
    if (!stream_->writer->Write(messages_[stream_->sent])) return CloseStream();
  }
  return absl::OkStatus();
}

absl::Status RemoteUpload::OpenStream() {
  STRATA_RETURN_IF_ERROR(call_.stop.status());
  stream_ = std::make_unique<Stream>(connection_, call_);
  stream_->writer = stub_.Upload(stream_->context.get(), &stream_->response);
  if (!stream_->writer->Write(start_)) return CloseStream();
  stream_->writer->WaitForInitialMetadata();
  const auto& metadata = stream_->context.get()->GetServerInitialMetadata();
  return metadata.count(kAcceptedKey) == 0 ? CloseStream() : absl::OkStatus();
}

absl::Status RemoteUpload::CloseStream() {
  const grpc::Status status = stream_->writer->Finish();
  stream_ = nullptr;
  if (status.ok()) return absl::InternalError("the server ended an upload before its end");
  return StatusOf(status, call_);
}

bool RemoteUpload::MayRepeat(const absl::Status& status) {
  return !forgotten_ && backoff_.Wait(status, call_.stop);
}

}  // namespace strata::sdk
