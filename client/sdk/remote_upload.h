// One scan on its way to the server, repeated when the way breaks.
#ifndef STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_
#define STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "client/sdk/backoff.h"
#include "client/sdk/connection.h"
#include "core/api/scans.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::sdk {

// Sends as it is written to, and keeps what it sent (up to 64 MiB; a larger scan is not repeated)
// so that another attempt can begin from the start: the server takes the same scan once. Not
// thread-safe; destroying it before Finish() abandons the scan.
class RemoteUpload final : public api::ScanUpload {
 public:
  RemoteUpload(Connection& connection,
               v1::Scans::Stub& stub,
               const api::Call& call,
               absl::string_view map,
               const ScanHeader& header);
  ~RemoteUpload() override;
  RemoteUpload(const RemoteUpload&) = delete;
  RemoteUpload& operator=(const RemoteUpload&) = delete;

  // Returns once the server has accepted the header.
  absl::Status Open();
  absl::Status Write(const PointCloud& chunk) override;
  absl::StatusOr<ScanAck> Finish() override;

 private:
  // One stream.
  struct Stream {
    Stream(Connection& connection, const api::Call& call) : context(connection, call) {}
    AttemptContext context;
    v1::UploadScanResponse response;
    std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>> writer;
    std::size_t sent = 0;  // messages of messages_
  };

  // Brings the server up to date, by as many attempts as the backoff allows.
  absl::Status Deliver();
  // One attempt's share of it.
  absl::Status Advance();
  absl::Status OpenStream();
  // Ends the stream; its status.
  absl::Status CloseStream();
  bool MayRepeat(const absl::Status& status);

  Connection& connection_;
  v1::Scans::Stub& stub_;
  const api::Call call_;
  const ScanHeader header_;
  v1::UploadScanRequest start_;
  std::vector<v1::UploadScanRequest> messages_;  // chunks that may have to be sent again
  std::size_t kept_bytes_ = 0;
  bool forgotten_ = false;  // messages_ is not the whole scan any more
  std::uint64_t points_ = 0;
  Backoff backoff_;
  std::unique_ptr<Stream> stream_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_
