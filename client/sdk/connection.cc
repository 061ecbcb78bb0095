#include "client/sdk/connection.h"

#include "absl/time/clock.h"

#include "core/common/steady_time.h"

namespace strata::sdk {
namespace {

// The server's name for the metadata that carries a call's id.
constexpr char kRequestIdKey[] = "x-request-id";

}  // namespace

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
