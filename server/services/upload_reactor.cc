#include "server/services/upload_reactor.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "proto/translate/scans.h"

namespace strata::server {

UploadReactor::UploadReactor(Runtime& runtime,
                             grpc::CallbackServerContext& context,
                             v1::UploadScanResponse& out)
    : runtime_(runtime),
      context_(context),
      request_(runtime, context, "Scans.Upload"),
      out_(out),
      expected_(runtime.silence, [this](const absl::Status& status) { End(status); }) {
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
  const absl::Status status = Guarded([this] { return TakeMessage(); });
  if (status.ok() && message_.has_start() && scan_->points_held() > 0 && scan_->complete()) {
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
  STRATA_RETURN_IF_ERROR(request_.Receive(message_));
  if (message_.has_start() && !scan_.has_value()) return Begin(message_.start());
  if (message_.has_chunk() && scan_.has_value()) return scan_->Add(message_.chunk());
  return AtTheDoor(absl::InvalidArgumentError(
      scan_.has_value() ? "upload: every message after the first is a chunk"
                        : "upload: the first message is the start of the scan"));
}

absl::Status UploadReactor::Begin(const v1::ScanStart& start) {
  STRATA_ASSIGN_OR_RETURN(scan_, ScanReceiver::Begin(runtime_.db, request_.call(), start));
  // Tells the client that its points are welcome, and which of them are there.
  context_.AddInitialMetadata("x-upload-accepted", absl::StrCat(scan_->points_held()));
  StartSendInitialMetadata();
  return absl::OkStatus();
}

void UploadReactor::Commit() {
  const absl::Status status = Guarded([this]() -> absl::Status {
    // The stream also ends when the client has gone: what it did not confirm is abandoned.
    STRATA_RETURN_IF_ERROR(request_.call().stop.status());
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
