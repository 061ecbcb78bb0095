#include "client/sdk/connection.h"

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/host_port.h"
#include "core/common/map_owner.h"
#include "core/common/steady_time.h"

namespace strata::sdk {
namespace {

// The server's name for the metadata that carries a call's id.
constexpr char kRequestIdKey[] = "x-request-id";
// How long a server that was named has to take a connection, and how long it is not asked again if
// it does not: its name may mean nothing here.
constexpr absl::Duration kConnecting = absl::Seconds(2);
constexpr absl::Duration kAway = absl::Seconds(5);

}  // namespace

std::shared_ptr<grpc::Channel> Connection::ChannelToOwner(const absl::Status& status) {
  const std::optional<std::string> owner = MapOwnerOf(status);
  if (!owner.has_value() || servers_ > 1) return nullptr;
  const absl::StatusOr<HostPort> address = ParseHostPort(*owner);
  if (!address.ok() || address->port == 0) return nullptr;
  // A token goes in plain text only where the caller has said that it may.
  if (!options_.token.empty() && !options_.tls.enabled() && !options_.insecure &&
      !address->loopback()) {
    return nullptr;
  }
  std::shared_ptr<grpc::Channel> channel;
  {
    absl::MutexLock lock(&mutex_);
    Owner& known = owners_[*owner];
    if (SteadyNow() < known.away_until) return nullptr;
    if (known.channel == nullptr) known.channel = make_channel_(*owner);
    channel = known.channel;
  }
  if (channel->WaitForConnected(absl::ToChronoTime(absl::Now() + kConnecting))) return channel;
  NoteAway(*owner);
  return nullptr;
}

void Connection::NoteAway(const std::string& owner) {
  absl::MutexLock lock(&mutex_);
  owners_[owner].away_until = SteadyNow() + kAway;
}

AttemptContext::AttemptContext(Connection& connection, const api::Call& call)
    : watch_(connection.canceller(), call.stop, context_) {
  if (call.stop.deadline() != absl::InfiniteFuture()) {
    context_.set_deadline(absl::ToChronoTime(absl::Now() + (call.stop.deadline() - SteadyNow())));
  }
  if (!connection.token().empty()) {
    context_.AddMetadata("authorization", "Bearer " + connection.token());
  }
  if (!call.request_id.empty()) context_.AddMetadata(kRequestIdKey, call.request_id);
}

absl::Status StatusOf(const grpc::Status& status, const api::Call& call) {
  if (status.ok()) return absl::OkStatus();
  if (absl::Status stopped = call.stop.status(); !stopped.ok()) return stopped;
  return translate::FromGrpcStatus(status);
}

}  // namespace strata::sdk
