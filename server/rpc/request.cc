#include "server/rpc/request.h"

#include <algorithm>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <glog/logging.h>
#include <grpcpp/server_context.h>

namespace strata::server {
namespace {

// Unique among the calls of this process and, very likely, of all others.
std::string NewRequestId() {
  static const std::uint32_t process = std::random_device()();
  static std::atomic<std::uint64_t> next = 1;
  return absl::StrCat(absl::Hex(process, absl::kZeroPad8), "-", next.fetch_add(1));
}

std::string RequestIdOf(const grpc::CallbackServerContext& context) {
  constexpr std::size_t kMaxLength = 64;
  const auto found = context.client_metadata().find(kRequestIdKey);
  if (found == context.client_metadata().end()) return NewRequestId();
  const absl::string_view id(found->second.data(), found->second.size());
  const bool usable =
      !id.empty() && id.size() <= kMaxLength &&
      std::all_of(id.begin(), id.end(), [](unsigned char c) { return absl::ascii_isgraph(c); });
  return usable ? std::string(id) : NewRequestId();
}

absl::Time DeadlineOf(const grpc::CallbackServerContext& context) {
  const std::chrono::system_clock::time_point deadline = context.deadline();
  return deadline == std::chrono::system_clock::time_point::max() ? absl::InfiniteFuture()
                                                                  : absl::FromChrono(deadline);
}

}  // namespace

Request::Request(Runtime& runtime,
                 grpc::CallbackServerContext& context,
                 absl::string_view method,
                 CallGate& gate)
    : runtime_(runtime),
      gate_(gate),
      method_(method),
      peer_(context.peer()),
      started_(absl::Now()),
      admitted_(gate.Enter()) {
  call_.stop = Stop(DeadlineOf(context));
  call_.request_id = RequestIdOf(context);
  context.AddInitialMetadata(kRequestIdKey, call_.request_id);
}

Request::~Request() { gate_.Leave(); }

absl::Status Request::admission() const {
  if (runtime_.shutting_down) {
    return translate::WithReason(absl::UnavailableError("the server is shutting down"),
                                 translate::kShuttingDownReason);
  }
  if (admitted_) return absl::OkStatus();
  return translate::WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "the server has its ", gate_.most(), " ", gate_.what(), " under way; try again later")),
      translate::kServerBusyReason);
}

grpc::Status Request::Close(const absl::Status& status) {
  LOG(INFO) << "method=" << method_ << " code=" << absl::StatusCodeToString(status.code())
            << " duration_ms=" << absl::ToInt64Milliseconds(absl::Now() - started_)
            << " bytes_received=" << bytes_received_ << " bytes_sent=" << bytes_sent_
            << " peer=" << peer_ << " id=" << call_.request_id;
  return translate::ToGrpcStatus(status, call_.request_id);
}

}  // namespace strata::server
