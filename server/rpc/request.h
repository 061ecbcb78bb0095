// One gRPC call under way, as the services see it.
#ifndef STRATA_SERVER_RPC_REQUEST_H_
#define STRATA_SERVER_RPC_REQUEST_H_

#include <atomic>
#include <cstddef>
#include <exception>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <google/protobuf/message_lite.h>
#include <grpcpp/support/server_callback.h>

#include "core/api/call.h"
#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// Metadata key of the call's id, in requests (chosen by the client: 1 to 64 printable characters
// without spaces; otherwise the server chooses) and in the answer's initial metadata.
inline constexpr char kRequestIdKey[] = "x-request-id";

// The context of a call (deadline, cancellation, id), its place among the calls under way, and its
// line in the log. Thread-safe, but for Close(), which is called once and last.
class Request {
 public:
  // `method` as in "Maps.Create"; must outlive the request. `gate`: what it counts among, the calls
  // or the watches.
  Request(Runtime& runtime,
          grpc::CallbackServerContext& context,
          absl::string_view method,
          CallGate& gate);
  Request(Runtime& runtime, grpc::CallbackServerContext& context, absl::string_view method)
      : Request(runtime, context, method, runtime.calls) {}
  ~Request();
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  // RESOURCE_EXHAUSTED when the server is full, UNAVAILABLE when it shuts down: the call must end
  // at once.
  absl::Status admission() const;
  const api::Call& call() const { return call_; }
  // The caller has gone: long work ends.
  void Cancel() { call_.stop.Request(); }
  // For the log.
  void CountReceived(const google::protobuf::MessageLite& message) {
    bytes_received_ += message.ByteSizeLong();
  }
  void CountSent(const google::protobuf::MessageLite& message) {
    bytes_sent_ += message.ByteSizeLong();
  }

  // Logs the call's one line; the result is what goes to the client.
  grpc::Status Close(const absl::Status& status);

 private:
  Runtime& runtime_;
  CallGate& gate_;
  const absl::string_view method_;
  const std::string peer_;
  const absl::Time started_;
  const bool admitted_;
  api::Call call_;
  std::atomic<std::size_t> bytes_received_ = 0;
  std::atomic<std::size_t> bytes_sent_ = 0;
};

// What of a request the door refused.
inline absl::Status AtTheDoor(const absl::Status& status) {
  return translate::WithReason(status, translate::kRequestReason);
}
template <typename T>
absl::StatusOr<T> AtTheDoor(absl::StatusOr<T> result) {
  if (result.ok()) return result;
  return AtTheDoor(result.status());
}

// Runs `body` (which returns absl::Status); what it throws becomes a status: no exception reaches
// gRPC or ends a thread.
template <typename Body>
absl::Status Guarded(const Body& body) {
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the server is out of memory");
  } catch (const std::exception& e) {
    return absl::InternalError(e.what());
  }
}

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_REQUEST_H_
