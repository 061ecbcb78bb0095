#include "server/services/upload_reactor.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "proto/translate/scans.h"

namespace strata::server {

UploadReactor::UploadReactor(Runtime& runtime, grpc::CallbackServerContext& context, Out& out)
    : runtime_(runtime),
      context_(context),
      request_(runtime, context, "Scans.Upload"),
      in_memory_(request_.NewBooking()),
      out_(out),
      expected_(runtime.silence, request_.call().stop, [this](const absl::Status& status) {
        End(status);
      }) {
  if (!request_.admission().ok()) {
    Finish(request_.Close(request_.admission()));
    return;
  }
  Read();
}

void UploadReactor::Read() {
  expected_.Expect();
  StartRead(&message_);
}

void UploadReactor::OnReadDone(bool ok) {
  if (!expected_.Arrived()) return;
  if (ok) {
    runtime_.uploads.Submit(request_.client(), [this] { Take(); });
  } else {
    runtime_.uploads.Submit(request_.client(), [this] { Commit(); });
  }
}

void UploadReactor::Take() {
  const bool begun = scan_.has_value();
  const absl::Status status = Guarded([this] { return TakeMessage(); });
  if (status.ok() && !begun && scan_->points_held() > 0 && scan_->complete()) {
    Commit();
    return;
  }
  if (status.ok()) {
    Read();
  } else {
    End(status);
  }
}

void UploadReactor::End(const absl::Status& error) {
  scan_.reset();
  Finish(request_.Close(error));
}

absl::Status UploadReactor::TakeMessage() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  In in;
  STRATA_RETURN_IF_ERROR(request_.Open(message_.bytes, in, in_memory_));
  if (in.has_start() && !scan_.has_value()) return Begin(in.start());
  if (in.has_chunk() && scan_.has_value()) return scan_->Add(in.chunk());
  return AtTheDoor(absl::InvalidArgumentError(
      scan_.has_value() ? "upload: every message after the first is a chunk"
                        : "upload: the first message is the start of the scan"));
}

absl::Status UploadReactor::Begin(const v1::ScanStart& start) {
  STRATA_RETURN_IF_ERROR(HoldChunk(start.header(), in_memory_));
  STRATA_ASSIGN_OR_RETURN(
      scan_, ScanReceiver::Begin(runtime_.db, request_.call(), start, request_.NewBooking()));
  // Tells the client that its points are welcome, and which of them are there.
  context_.AddInitialMetadata("x-upload-accepted", absl::StrCat(scan_->points_held()));
  StartSendInitialMetadata();
  return absl::OkStatus();
}

void UploadReactor::Commit() {
  const absl::Status status = Guarded([this]() -> absl::Status {
    // The stream also ends when the client has gone: what it did not confirm is abandoned.
    STRATA_RETURN_IF_ERROR(request_.call().stop.status());
    STRATA_RETURN_IF_ERROR(request_.StillAllowed());
    if (!scan_.has_value()) {
      return AtTheDoor(
          absl::InvalidArgumentError("upload: the stream ended before its scan began"));
    }
    const absl::Time begun = SteadyNow();
    STRATA_ASSIGN_OR_RETURN(const ScanAck ack, scan_->Finish());
    runtime_.metrics.Acknowledged(SteadyNow() - begun);
    *out_.mutable_ack() = translate::ToProto(ack);
    return absl::OkStatus();
  });
  scan_.reset();
  request_.CountSent(out_);
  Finish(request_.Close(status));
}

}  // namespace strata::server
