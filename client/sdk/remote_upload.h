// One scan on its way to the server, repeated when the way breaks.
#ifndef STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_
#define STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/sdk/backoff.h"
#include "client/sdk/connection.h"
#include "core/api/scans.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::sdk {

// Sends as it is written to, and keeps what it sent last (64 MiB) for another attempt. Of an
// announced scan the server has told what it holds, and the attempt goes on behind that; any other
// begins from the start, and a larger one is not repeated. Not thread-safe; destroying it before
// Finish() abandons the scan, see api::ScanUpload.
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
  std::uint64_t points_held() const override { return held_; }
  absl::Status Write(const PointCloud& chunk) override;
  absl::StatusOr<ScanAck> Finish() override;

 private:
  // One stream.
  struct Stream {
    Stream(Connection& connection, const api::Call& call) : context(connection, call) {}
    AttemptContext context;
    v1::UploadScanResponse response;
    std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>> writer;
    std::uint64_t sent = 0;  // points, with those that were there
  };
  // Points that may have to be sent again.
  struct Chunk {
    std::uint64_t first;
    std::uint64_t end;
    v1::UploadScanRequest message;
  };

  // Brings the server up to date, by as many attempts as the backoff allows.
  absl::Status Deliver();
  // One attempt's share of it.
  absl::Status Advance();
  absl::Status OpenStream();
  // Goes on behind the points that the server says are there. ABORTED if those that it lacks are
  // not kept any more.
  absl::Status GoOnFrom(absl::string_view accepted);
  // False if the stream has ended.
  bool Send(const Chunk& chunk);
  // Lets go of what need not be kept for another attempt.
  void Forget();
  // Ends the stream; its status.
  absl::Status CloseStream();
  bool MayRepeat(const absl::Status& status);

  Connection& connection_;
  Route<v1::Scans::Stub> route_;
  const api::Call call_;
  const ScanHeader header_;
  v1::UploadScanRequest start_;
  std::deque<Chunk> chunks_;
  std::size_t kept_bytes_ = 0;
  std::uint64_t held_ = 0;       // by the server when the upload began
  std::uint64_t most_held_ = 0;  // by the server when an attempt began
  std::uint64_t points_ = 0;     // held or written
  Backoff backoff_;
  std::unique_ptr<Stream> stream_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_UPLOAD_H_
