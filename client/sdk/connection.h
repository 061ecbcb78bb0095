// What every call to a server needs: the channel, the context, and another attempt.
#ifndef STRATA_CLIENT_SDK_CONNECTION_H_
#define STRATA_CLIENT_SDK_CONNECTION_H_

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
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
  // Makes a channel to one more server.
  using MakeChannel = std::function<std::shared_ptr<grpc::Channel>(const std::string& address)>;

  // `servers`: that the channel goes to.
  Connection(std::shared_ptr<grpc::Channel> channel,
             const ClientOptions& options,
             int servers,
             MakeChannel make_channel)
      : channel_(std::move(channel)),
        options_(options),
        servers_(servers),
        make_channel_(std::move(make_channel)) {}

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  Canceller& canceller() { return canceller_; }
  const std::string& token() const { return options_.token; }
  // To the server that has the map, as the `status` of a refused call has it; nullptr where the
  // channel finds it by itself, where its name is no address, or where nobody answers there, for
  // which this waits a little.
  std::shared_ptr<grpc::Channel> ChannelToOwner(const absl::Status& status);
  // That nobody answers there.
  void NoteAway(const std::string& owner);
  Backoff NewBackoff() const { return Backoff(options_.backoff, servers_); }
  // For one who waits for the server as long as it takes.
  Backoff NewEndlessBackoff() const {
    BackoffOptions endless = options_.backoff;
    endless.max_attempts = 0;
    return Backoff(endless, servers_);
  }

 private:
  struct Owner {
    std::shared_ptr<grpc::Channel> channel;
    absl::Time away_until = absl::InfinitePast();  // by SteadyNow()
  };

  std::shared_ptr<grpc::Channel> channel_;
  ClientOptions options_;
  int servers_;
  MakeChannel make_channel_;
  Canceller canceller_;
  absl::Mutex mutex_;
  std::map<std::string, Owner> owners_ ABSL_GUARDED_BY(mutex_);  // by address
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

// Where the attempts of a call go: to the connection's own servers, or to the one of which they say
// that it has the map.
template <typename Stub>
class Route {
 public:
  // Both must outlive it.
  Route(Connection& connection, Stub& own) : connection_(connection), own_(own) {}

  Stub& stub() { return elsewhere_ == nullptr ? own_ : *elsewhere_; }
  // To be told what each attempt ended with, before `backoff` is.
  void Follow(const absl::Status& status, Backoff& backoff) {
    const std::optional<std::string> owner = MapOwnerOf(status);
    if (!owner.has_value() && absl::IsUnavailable(status) && elsewhere_ != nullptr) {
      connection_.NoteAway(owner_);
    }
    elsewhere_ = nullptr;
    const std::shared_ptr<grpc::Channel> channel = connection_.ChannelToOwner(status);
    if (channel == nullptr) return;
    owner_ = *owner;
    elsewhere_ = std::make_unique<Stub>(channel);
    backoff.NoteServerNamed();
  }

 private:
  Connection& connection_;
  Stub& own_;
  std::unique_ptr<Stub> elsewhere_;
  std::string owner_;
};

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
  Route<Stub> route(connection, stub);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());  // else a quick server may answer it all the same
    AttemptContext context(connection, call);
    Out out;
    absl::Status status = StatusOf((route.stub().*method)(context.get(), in, &out), call);
    if (status.ok()) return out;
    route.Follow(status, backoff);
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
  Route<Stub> route(connection, stub);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    AttemptContext context(connection, call);
    const std::unique_ptr<grpc::ClientReader<Out>> reader =
        (route.stub().*method)(context.get(), in);
    bool delivered = false;
    absl::Status status = ReadStream(context, *reader, call, sink, delivered);
    route.Follow(status, backoff);
    // What was delivered cannot be taken back.
    if (status.ok() || delivered || !backoff.Wait(status, call.stop)) return status;
  }
}

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_CONNECTION_H_
