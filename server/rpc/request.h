// One gRPC call under way, as the services see it.
#ifndef STRATA_SERVER_RPC_REQUEST_H_
#define STRATA_SERVER_RPC_REQUEST_H_

#include <atomic>
#include <cstddef>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "core/api/call.h"
#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/access/access.h"
#include "server/rpc/client_limits.h"
#include "server/rpc/revocation.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// Metadata key of the call's id, in requests (chosen by the client: 1 to 64 printable characters
// without spaces; otherwise the server chooses) and in the answer's initial metadata.
inline constexpr char kRequestIdKey[] = "x-request-id";
// Metadata of a call that the web door makes within this process: whose it is, as gRPC names a
// peer.
inline constexpr char kWebPeerKey[] = "x-strata-web-peer";
// In the metrics: who was refused because nobody knows him.
inline constexpr absl::string_view kStranger = "STRANGER";

// The context of a call (deadline, cancellation, id, who calls), its place among the calls under
// way, and its line in the log. Every message that comes in goes through Open(), which is where it
// is parsed and rights are checked. Thread-safe, but for Open(), called one at a time, and Close(),
// called once and last. A call whose caller may no longer do what it does is stopped, and ends with
// the reason.
class Request final : public Revocable {
 public:
  using Kind = ClientLimits::Kind;

  // `method` as in "Maps.Create"; must outlive the request. `kind`: what it counts among. `limit`:
  // how long it may take, whatever the caller allows.
  Request(Runtime& runtime,
          grpc::CallbackServerContext& context,
          absl::string_view method,
          Kind kind = Kind::kCall,
          absl::Duration limit = absl::InfiniteDuration());
  ~Request() override;
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  // UNAUTHENTICATED for a caller nobody knows, RESOURCE_EXHAUSTED when the server is full or the
  // caller has all it may have, UNAVAILABLE when the server shuts down: the call must end at once.
  const absl::Status& admission() const { return admission_; }
  // Makes `message` of the bytes of a caller who was let in, books in `memory` what it takes,
  // unless as much is booked there, and checks that the caller may do to the map it names what the
  // method does; a message without a map goes with the one before. The bytes are freed in any case.
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED before anything is parsed; UNAUTHENTICATED,
  // PERMISSION_DENIED.
  absl::Status Open(grpc::ByteBuffer& bytes, google::protobuf::Message& message, Booking& memory);
  // For a call that goes on and on: that the caller may still do what Open() checked.
  absl::Status StillAllowed() const;
  // Memory of this call, which must be gone before it.
  Booking NewBooking() { return Booking(runtime_.clients, client_); }
  // For the one answer that tells of many maps.
  bool MayRead(absl::string_view map) const { return runtime_.access.MayRead(caller_, map); }
  const api::Call& call() const { return call_; }
  // The first time stops the call, which then ends itself; the next time, since it has not, cancels
  // it under the hands of gRPC.
  void EndIfRevoked() override;
  // Whose turn it is where calls wait for each other. Of a call that was let in.
  const std::string& client() const { return client_; }
  // The caller has gone: long work ends.
  void Cancel() { call_.stop.Request(); }
  // For the log.
  void CountSent(const google::protobuf::MessageLite& message) {
    bytes_sent_ += message.ByteSizeLong();
  }
  // Books in `memory` an answer that goes out: as a message, and as the bytes that it becomes.
  static absl::Status HoldAnswer(const google::protobuf::Message& message, Booking& memory);

  // `status`, or where the limit ended the call, that.
  absl::Status NameLimit(const absl::Status& status) const;

  // Logs the call's one line; the result is what goes to the client.
  grpc::Status Close(const absl::Status& status);

 private:
  CallGate& gate() { return kind_ == Kind::kCall ? runtime_.calls : runtime_.watches; }
  // Finds out who calls, and books the call.
  absl::Status Admit(const grpc::CallbackServerContext& context);
  // Limits of the server and of this client.
  absl::Status EnterLimits();
  absl::Status Parse(grpc::ByteBuffer& bytes, google::protobuf::Message& message, Booking& memory);
  absl::Status Authorize(const google::protobuf::Message& message);
  // What a caller whom nobody knows is told.
  absl::Status Refuse(const absl::Status& status);
  absl::Status MayGoOn() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Makes room for another one. Again: nothing.
  void End();
  // The lines of the log: one a call, and of what changes a map one for whoever asks later who did.
  void Log(const absl::Status& status, absl::Duration duration);

  Runtime& runtime_;
  grpc::CallbackServerContext& context_;
  const Kind kind_;
  const absl::string_view method_;
  const std::string peer_;
  const absl::Time started_;
  const absl::Duration limit_;
  Caller caller_;
  bool arrived_ = false;   // among the arrivals
  bool stranger_ = false;  // nobody knows who calls
  mutable absl::Mutex mutex_;
  std::string map_ ABSL_GUARDED_BY(mutex_);  // that the last message with a map named
  bool has_map_ ABSL_GUARDED_BY(mutex_) = false;
  std::string object_ ABSL_GUARDED_BY(mutex_);  // of the map, that the last message with one named
  bool allowed_ ABSL_GUARDED_BY(mutex_) = false;  // to do to that map what the method does
  absl::Status revoked_ ABSL_GUARDED_BY(mutex_);  // not OK: why the call was stopped
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::string client_;    // whose limits hold; empty: none were booked
  bool entered_ = false;  // the server's gate
  api::Call call_;
  absl::Status admission_;
  std::atomic<std::size_t> bytes_received_ = 0;
  std::atomic<std::size_t> bytes_sent_ = 0;
};

// gRPC's name of whoever calls; of a call of the web door's, what that says. From elsewhere the
// metadata are not looked at.
std::string PeerOf(const grpc::CallbackServerContext& context);
// gRPC's name of a peer without its port: a client that comes by many connections is one.
std::string HostOf(absl::string_view peer);

// What of a request the door refused.
inline absl::Status AtTheDoor(const absl::Status& status) {
  return translate::WithReason(status, translate::kRequestReason);
}
// What a call gets that should have brought one message.
inline absl::Status NoRequest() {
  return AtTheDoor(absl::InvalidArgumentError("the call ended before it brought a request"));
}
template <typename T>
absl::StatusOr<T> AtTheDoor(absl::StatusOr<T> result) {
  if (result.ok()) return result;
  return AtTheDoor(result.status());
}

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_REQUEST_H_
