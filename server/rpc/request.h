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
#include <google/protobuf/message.h>
#include <grpcpp/support/server_callback.h>

#include "core/api/call.h"
#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/access/access.h"
#include "server/rpc/client_limits.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// Metadata key of the call's id, in requests (chosen by the client: 1 to 64 printable characters
// without spaces; otherwise the server chooses) and in the answer's initial metadata.
inline constexpr char kRequestIdKey[] = "x-request-id";

// The context of a call (deadline, cancellation, id, who calls), its place among the calls under
// way, and its line in the log. Every message that comes in goes through Receive(), which is where
// rights are checked. Thread-safe, but for Receive(), called one at a time, and Close(), called
// once and last.
class Request {
 public:
  using Kind = ClientLimits::Kind;

  // `method` as in "Maps.Create"; must outlive the request. `kind`: what it counts among. `limit`:
  // how long it may take, whatever the caller allows.
  Request(Runtime& runtime,
          grpc::CallbackServerContext& context,
          absl::string_view method,
          Kind kind = Kind::kCall,
          absl::Duration limit = absl::InfiniteDuration());
  ~Request();
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  // UNAUTHENTICATED for a caller nobody knows, RESOURCE_EXHAUSTED when the server is full or the
  // caller has all it may have, UNAVAILABLE when the server shuts down: the call must end at once.
  const absl::Status& admission() const { return admission_; }
  // Counts a message and checks that the caller may do to the map it names what the method does; a
  // message without a map goes with the one before. UNAUTHENTICATED, PERMISSION_DENIED.
  absl::Status Receive(const google::protobuf::Message& message);
  // For a call that goes on and on: that the caller may still do what Receive() checked.
  absl::Status StillAllowed();
  // For the one answer that tells of many maps.
  bool MayRead(absl::string_view map) const { return runtime_.access.MayRead(caller_, map); }
  const api::Call& call() const { return call_; }
  // Whose turn it is where calls wait for each other. Of a call that was let in.
  const std::string& client() const { return client_; }
  // The caller has gone: long work ends.
  void Cancel() { call_.stop.Request(); }
  // For the log.
  void CountSent(const google::protobuf::MessageLite& message) {
    bytes_sent_ += message.ByteSizeLong();
  }

  // `status`, or where the limit ended the call, that.
  absl::Status NameLimit(const absl::Status& status) const;

  // Logs the call's one line; the result is what goes to the client.
  grpc::Status Close(const absl::Status& status);

 private:
  CallGate& gate() { return kind_ == Kind::kCall ? runtime_.calls : runtime_.watches; }
  // Finds out who calls, and books the call.
  absl::Status Admit(const grpc::CallbackServerContext& context);
  // Of the server and of this client.
  absl::Status EnterLimits();
  // Makes room for another one. Again: nothing.
  void End();
  // The lines of the log: one a call, and of what changes a map one for whoever asks later who did.
  void Log(const absl::Status& status, absl::Duration duration) const;

  Runtime& runtime_;
  const Kind kind_;
  const absl::string_view method_;
  const std::string peer_;
  const absl::Time started_;
  const absl::Duration limit_;
  Caller caller_;
  std::string map_;  // that the last message with a map named
  bool has_map_ = false;
  std::string object_;    // of the map, that the last message with one named
  std::string client_;    // whose limits hold; empty: none were booked
  bool entered_ = false;  // the server's gate
  bool ended_ = false;
  api::Call call_;
  absl::Status admission_;
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
