// What every call to a server needs: the channel, the context, and another attempt.
#ifndef STRATA_CLIENT_SDK_CONNECTION_H_
#define STRATA_CLIENT_SDK_CONNECTION_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>

#include "client/sdk/backoff.h"
#include "client/sdk/canceller.h"
#include "client/sdk/client.h"
#include "core/api/call.h"
#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "proto/translate/status.h"

namespace strata::sdk {

// Thread-safe.
class Connection {
 public:
  // `servers`: that the channel goes to.
  Connection(std::shared_ptr<grpc::Channel> channel, const ClientOptions& options, int servers)
      : channel_(std::move(channel)), options_(options), servers_(servers) {}

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  Canceller& canceller() { return canceller_; }
  const std::string& token() const { return options_.token; }
  Backoff NewBackoff() const { return Backoff(options_.backoff, servers_); }
  // For one who waits for the server as long as it takes.
  Backoff NewEndlessBackoff() const {
    BackoffOptions endless = options_.backoff;
    endless.max_attempts = 0;
    return Backoff(endless, servers_);
  }

 private:
  std::shared_ptr<grpc::Channel> channel_;
  ClientOptions options_;
  int servers_;
  Canceller canceller_;
};

// A gRPC context with the call's deadline, id and cancellation; for one attempt.
class AttemptContext {
 public:
  AttemptContext(Connection& connection, const api::Call& call);
  grpc::ClientContext* get() { return &context_; }

 private:
  grpc::ClientContext context_;
  Canceller::Watch watch_;
};

// Ends the attempt's status as the caller knows it: a call that the caller's own Stop ended says
// so, whatever gRPC made of it.
absl::Status StatusOf(const grpc::Status& status, const api::Call& call);

// What was refused because another server has the map is sent there either way.
enum class Repeat { kNever, kOnTrouble };

// One request, one answer: `method` is a member of the generated stub.
template <typename Stub, typename In, typename Out>
absl::StatusOr<Out> CallUnary(Connection& connection,
                              Stub& stub,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const In&, Out*),
                              const api::Call& call,
                              Repeat repeat,
                              const In& in) {
  Backoff backoff = connection.NewBackoff();
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());  // else a quick server may answer it all the same
    AttemptContext context(connection, call);
    Out out;
    absl::Status status = StatusOf((stub.*method)(context.get(), in, &out), call);
    if (status.ok()) return out;
    const bool again = repeat == Repeat::kOnTrouble || MapOwnerOf(status).has_value();
    if (!again || !backoff.Wait(status, call.stop)) return status;
  }
}

// Reads one attempt's stream to its end or to the sink's error, which is handed back.
template <typename Out, typename Sink>
absl::Status ReadStream(AttemptContext& context,
                        grpc::ClientReader<Out>& reader,
                        const api::Call& call,
                        const Sink& sink,
                        bool& delivered) {
  absl::Status taken;
  for (Out out; taken.ok() && reader.Read(&out);) {
    delivered = true;
    taken = sink(out);
  }
  if (!taken.ok()) context.get()->TryCancel();
  const grpc::Status ended = reader.Finish();
  return taken.ok() ? StatusOf(ended, call) : taken;
}

// One request, a stream of answers: `method` as in CallUnary, `sink` takes each message and ends
// the stream by an error.
template <typename Stub, typename In, typename Out, typename Sink>
absl::Status CallStream(
    Connection& connection,
    Stub& stub,
    std::unique_ptr<grpc::ClientReader<Out>> (Stub::*method)(grpc::ClientContext*, const In&),
    const api::Call& call,
    const In& in,
    const Sink& sink) {
  Backoff backoff = connection.NewBackoff();
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    AttemptContext context(connection, call);
    const std::unique_ptr<grpc::ClientReader<Out>> reader = (stub.*method)(context.get(), in);
    bool delivered = false;
    absl::Status status = ReadStream(context, *reader, call, sink, delivered);
    // What was delivered cannot be taken back.
    if (status.ok() || delivered || !backoff.Wait(status, call.stop)) return status;
  }
}

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_CONNECTION_H_
