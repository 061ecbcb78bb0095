#include "client/sdk/remote_upload.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/api/chunk_check.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"

namespace strata::sdk {
namespace {

constexpr std::size_t kMaxKeptBytes = std::size_t{64} << 20;
// The server's word, in its initial metadata, that the points are welcome, and how many it has.
constexpr char kAcceptedKey[] = "x-upload-accepted";

}  // namespace

RemoteUpload::RemoteUpload(Connection& connection,
                           v1::Scans::Stub& stub,
                           const api::Call& call,
                           absl::string_view map,
                           const ScanHeader& header)
    : connection_(connection),
      route_(connection, stub),
      call_(call),
      header_(header),
      backoff_(connection.NewBackoff()) {
  start_.mutable_start()->set_map(std::string(map));
  *start_.mutable_start()->mutable_header() = translate::ToProto(header);
  start_.mutable_start()->set_resume(true);
}

RemoteUpload::~RemoteUpload() {
  if (stream_ == nullptr) return;
  // A cancelled stream looks to the server like one that ended, and it may have every point; an
  // empty message is refused in its turn, whatever came before.
  stream_->writer->Write(v1::UploadScanRequest());
  stream_->writer->Finish();
}

absl::Status RemoteUpload::Open() {
  STRATA_RETURN_IF_ERROR(Deliver());
  held_ = stream_->sent;
  points_ = held_;
  return absl::OkStatus();
}

absl::Status RemoteUpload::Write(const PointCloud& chunk) {
  if (chunk.points.empty()) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(Annotate(api::CheckChunk(chunk, header_, points_),
                                  absl::StrCat("scan ", header_.id.ToString())));
  Chunk& kept = chunks_.emplace_back(Chunk{points_, points_ + chunk.size(), {}});
  points_ = kept.end;
  *kept.message.mutable_chunk() = translate::ToProto(chunk);
  kept_bytes_ += kept.message.ByteSizeLong();
  STRATA_RETURN_IF_ERROR(Deliver());
  Forget();
  return absl::OkStatus();
}

void RemoteUpload::Forget() {
  while (kept_bytes_ > kMaxKeptBytes) {
    kept_bytes_ -= chunks_.front().message.ByteSizeLong();
    chunks_.pop_front();
  }
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
  if (stream_ == nullptr) STRATA_RETURN_IF_ERROR(OpenStream());
  for (const Chunk& chunk : chunks_) {
    if (chunk.end <= stream_->sent) continue;
    if (!Send(chunk)) return CloseStream();
    stream_->sent = chunk.end;
  }
  return absl::OkStatus();
}

bool RemoteUpload::Send(const Chunk& chunk) {
  if (chunk.first >= stream_->sent) return stream_->writer->Write(chunk.message);
  v1::UploadScanRequest rest = chunk.message;
  translate::DropFirst(stream_->sent - chunk.first, *rest.mutable_chunk());
  return stream_->writer->Write(rest);
}

absl::Status RemoteUpload::OpenStream() {
  STRATA_RETURN_IF_ERROR(call_.stop.status());
  stream_ = std::make_unique<Stream>(connection_, call_);
  stream_->writer = route_.stub().Upload(stream_->context.get(), &stream_->response);
  if (!stream_->writer->Write(start_)) return CloseStream();
  stream_->writer->WaitForInitialMetadata();
  const auto& metadata = stream_->context.get()->GetServerInitialMetadata();
  const auto accepted = metadata.find(kAcceptedKey);
  if (accepted == metadata.end()) return CloseStream();
  const absl::Status resumed =
      GoOnFrom(absl::string_view(accepted->second.data(), accepted->second.size()));
  if (resumed.ok()) return resumed;
  stream_->context.get()->TryCancel();
  stream_->writer->Finish();
  stream_ = nullptr;
  return resumed;
}

absl::Status RemoteUpload::GoOnFrom(absl::string_view accepted) {
  const std::string what = absl::StrCat("scan ", header_.id.ToString());
  std::uint64_t held = 0;
  if (!absl::SimpleAtoi(accepted, &held) || held > header_.point_count) {
    return absl::InternalError(absl::StrCat(
        what, ": the server has accepted '", accepted, "' points of ", header_.point_count));
  }
  const std::uint64_t kept_from = chunks_.empty() ? points_ : chunks_.front().first;
  if (held < kept_from) {
    return absl::AbortedError(absl::StrCat(what,
                                           ": its upload broke off, and the server has only ",
                                           held,
                                           " points of it; begin it again"));
  }
  stream_->sent = held;
  if (held > most_held_) backoff_ = connection_.NewBackoff();  // the attempts before were worth it
  most_held_ = std::max(most_held_, held);
  return absl::OkStatus();
}

absl::Status RemoteUpload::CloseStream() {
  const grpc::Status status = stream_->writer->Finish();
  stream_ = nullptr;
  if (status.ok()) return absl::InternalError("the server ended an upload before its end");
  return StatusOf(status, call_);
}

bool RemoteUpload::MayRepeat(const absl::Status& status) {
  route_.Follow(status, backoff_);
  return backoff_.Wait(status, call_.stop);
}

}  // namespace strata::sdk
