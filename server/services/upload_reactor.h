// Scans.Upload: one scan, a client stream.
#ifndef STRATA_SERVER_SERVICES_UPLOAD_REACTOR_H_
#define STRATA_SERVER_SERVICES_UPLOAD_REACTOR_H_

#include <optional>

#include "absl/status/status.h"

#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"
#include "server/services/scan_receiver.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::server {

// Reads a message only when the one before is dealt with: memory is one message a stream, and a
// busy database slows its clients down. Lives from the call's arrival to its end; owns itself.
class UploadReactor final : public grpc::ServerReadReactor<Sealed<v1::UploadScanRequest>> {
 public:
  using In = v1::UploadScanRequest;
  using Out = v1::UploadScanResponse;

  UploadReactor(Runtime& runtime, grpc::CallbackServerContext& context, Out& out);

 private:
  void Read();
  void OnReadDone(bool ok) override;
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  // These run on an upload thread, one at a time.
  void End(const absl::Status& error);
  void Take();
  absl::Status TakeMessage();
  absl::Status Begin(const v1::ScanStart& start);
  void Commit();

  Runtime& runtime_;
  grpc::CallbackServerContext& context_;
  Request request_;
  Booking in_memory_;
  Out& out_;
  Sealed<In> message_;
  std::optional<ScanReceiver> scan_;
  ExpectedMessage expected_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_UPLOAD_REACTOR_H_
