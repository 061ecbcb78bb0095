#include "server/rpc/request.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <random>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include "core/common/log_line.h"
#include "core/common/steady_time.h"
#include "server/access/method_rights.h"
#include "server/access/right.h"
#include "server/rpc/call_object.h"
#include "server/rpc/wire_check.h"

namespace strata::server {
namespace {

constexpr std::size_t kMaxLoggedName = 100;
// What gRPC calls the other end of a channel within the process; that of a socket has an address.
constexpr absl::string_view kNoPeer = "unknown";
constexpr std::size_t kMaxLoggedMessage = 300;

// Unique among the calls of this process and, very likely, of all others.
std::string NewRequestId() {
  static const std::uint32_t process = std::random_device()();
  static std::atomic<std::uint64_t> next = 1;
  return absl::StrCat(absl::Hex(process, absl::kZeroPad8), "-", next.fetch_add(1));
}

// Empty without it.
absl::string_view MetadataOf(const grpc::CallbackServerContext& context, const char* key) {
  const auto found = context.client_metadata().find(key);
  if (found == context.client_metadata().end()) return "";
  return {found->second.data(), found->second.size()};
}

std::string RequestIdOf(const grpc::CallbackServerContext& context) {
  constexpr std::size_t kMaxLength = 64;
  const absl::string_view id = MetadataOf(context, kRequestIdKey);
  const bool usable =
      !id.empty() && id.size() <= kMaxLength &&
      std::all_of(id.begin(), id.end(), [](unsigned char c) { return absl::ascii_isgraph(c); });
  return usable ? std::string(id) : NewRequestId();
}

absl::Time DeadlineOf(const grpc::CallbackServerContext& context) {
  const std::chrono::system_clock::time_point deadline = context.deadline();
  return deadline == std::chrono::system_clock::time_point::max()
             ? absl::InfiniteFuture()
             : SteadyNow() + absl::FromChrono(deadline - std::chrono::system_clock::now());
}

// `reason` if it says that the call was not let in, or thrown out; else empty.
absl::string_view Rejection(absl::string_view reason) {
  const bool answered = reason == translate::kDatabaseReason || reason == translate::kRequestReason;
  return answered ? "" : reason;
}

absl::Status NobodyMay(absl::string_view method) {
  return absl::PermissionDeniedError(absl::StrCat("nobody may call ", method));
}

}  // namespace

std::string PeerOf(const grpc::CallbackServerContext& context) {
  std::string peer = context.peer();
  if (peer != kNoPeer) return peer;
  const absl::string_view told = MetadataOf(context, kWebPeerKey);
  return told.empty() ? peer : std::string(told);
}

std::string HostOf(absl::string_view peer) {
  return std::string(absl::StartsWith(peer, "ipv") ? peer.substr(0, peer.rfind(':')) : peer);
}

Request::Request(Runtime& runtime,
                 grpc::CallbackServerContext& context,
                 absl::string_view method,
                 Kind kind,
                 absl::Duration limit)
    : runtime_(runtime),
      context_(context),
      kind_(kind),
      method_(method),
      peer_(PeerOf(context)),
      started_(SteadyNow()),
      limit_(limit) {
  call_.stop = Stop(std::min(DeadlineOf(context), started_ + limit));
  call_.request_id = RequestIdOf(context);
  context.AddInitialMetadata(kRequestIdKey, call_.request_id);
  // In the gate also when it is refused: until the call has ended, it uses what a server must give
  // back before it goes.
  entered_ = gate().Enter();
  admission_ = Admit(context);
  if (runtime_.access.asks() && admission_.ok()) runtime_.revocations.Add(*this);
}

Request::~Request() {
  if (runtime_.access.asks() && admission_.ok()) runtime_.revocations.Remove(*this);
  End();
  gate().Leave();
  if (arrived_) runtime_.ArrivalsOf(method_).Leave(caller_.principal);
  if (stranger_) runtime_.strangers.Leave();
}

void Request::End() {
  {
    absl::MutexLock lock(&mutex_);
    if (std::exchange(ended_, true)) return;
  }
  if (!client_.empty()) runtime_.clients.Leave(client_, kind_);
  gate().End();
}

absl::Status Request::Admit(const grpc::CallbackServerContext& context) {
  if (runtime_.shutting_down) {
    return translate::WithReason(absl::UnavailableError("the server is shutting down"),
                                 translate::kShuttingDownReason);
  }
  absl::StatusOr<Caller> caller = runtime_.access.Authenticate(
      MetadataOf(context, kAuthorizationKey), CertificateNameOf(*context.auth_context()));
  if (!caller.ok()) return Refuse(caller.status());
  caller_ = *std::move(caller);
  arrived_ = true;
  runtime_.ArrivalsOf(method_).Begin(caller_.principal, started_);
  call_.principal = caller_.principal;
  return EnterLimits();
}

absl::Status Request::Refuse(const absl::Status& status) {
  stranger_ = true;
  STRATA_RETURN_IF_ERROR(runtime_.strangers.Enter(HostOf(peer_), started_));
  return status;
}

absl::Status Request::EnterLimits() {
  const std::string client = caller_.principal.empty() ? HostOf(peer_) : caller_.principal;
  STRATA_RETURN_IF_ERROR(runtime_.clients.Enter(client, kind_, started_));
  client_ = client;
  if (entered_) return absl::OkStatus();
  return translate::WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "the server has its ", gate().most(), " ", gate().what(), " under way; try again later")),
      translate::kServerBusyReason);
}

absl::Status Request::Open(grpc::ByteBuffer& bytes,
                           google::protobuf::Message& message,
                           Booking& memory) {
  bytes_received_ += bytes.Length();
  const absl::Status parsed = Parse(bytes, message, memory);
  bytes.Clear();
  STRATA_RETURN_IF_ERROR(parsed);
  return Authorize(message);
}

absl::Status Request::Parse(grpc::ByteBuffer& bytes,
                            google::protobuf::Message& message,
                            Booking& memory) {
  {
    grpc::ProtoBufferReader reader(&bytes);
    STRATA_ASSIGN_OR_RETURN(const std::size_t parsed_bytes,
                            AtTheDoor(ParsedBytes(*message.GetDescriptor(), reader)));
    if (parsed_bytes > memory.bytes()) STRATA_RETURN_IF_ERROR(memory.Resize(parsed_bytes));
  }
  grpc::ProtoBufferReader reader(&bytes);
  if (message.ParseFromZeroCopyStream(&reader)) return absl::OkStatus();
  return AtTheDoor(absl::InvalidArgumentError(
      absl::StrCat("the request's bytes are no ", message.GetDescriptor()->full_name())));
}

absl::Status Request::Authorize(const google::protobuf::Message& message) {
  const MethodRight* row = FindMethodRight(method_);
  if (row == nullptr) return NobodyMay(method_);
  std::optional<std::string> map = MapNamedIn(message, row->map_field);
  absl::MutexLock lock(&mutex_);
  if (map.has_value()) {
    map_ = *std::move(map);
    object_ = ObjectNamedIn(message).substr(0, kMaxLoggedName);
    has_map_ = true;
  }
  const absl::Status allowed = MayGoOn();
  allowed_ = allowed.ok();
  return allowed;
}

absl::Status Request::MayGoOn() const {
  const MethodRight* row = FindMethodRight(method_);
  if (row == nullptr) return NobodyMay(method_);
  return has_map_ ? runtime_.access.Authorize(caller_, row->right, map_)
                  : runtime_.access.StillKnown(caller_);
}

absl::Status Request::StillAllowed() const {
  absl::MutexLock lock(&mutex_);
  return MayGoOn();
}

void Request::EndIfRevoked() {
  absl::MutexLock lock(&mutex_);
  if (ended_) return;
  if (!revoked_.ok()) {
    context_.TryCancel();
    return;
  }
  // Who was refused a map may have another in the same stream.
  revoked_ = allowed_ ? MayGoOn() : runtime_.access.StillKnown(caller_);
  if (!revoked_.ok()) call_.stop.Request();
}

absl::Status Request::HoldAnswer(const google::protobuf::Message& message, Booking& memory) {
  return memory.Resize(message.SpaceUsedLong() + message.ByteSizeLong());
}

absl::Status Request::NameLimit(const absl::Status& status) const {
  const bool reached = absl::IsDeadlineExceeded(status) &&
                       call_.stop.deadline() == started_ + limit_ &&
                       SteadyNow() >= call_.stop.deadline();
  if (!reached) return status;
  return absl::DeadlineExceededError(absl::StrCat(method_,
                                                  " took longer than a query may, ",
                                                  absl::FormatDuration(limit_),
                                                  " (--max-query-time); ask for less at a time"));
}

grpc::Status Request::Close(const absl::Status& ended_with) {
  End();
  absl::Status status = ended_with;
  {
    absl::MutexLock lock(&mutex_);
    if (!status.ok() && !revoked_.ok()) status = revoked_;
  }
  const absl::Duration duration = SteadyNow() - started_;
  const std::optional<v1::ErrorDetail> detail = translate::DetailOf(status);
  runtime_.metrics.Ended(
      method_,
      status.code(),
      duration,
      bytes_received_,
      bytes_sent_,
      stranger_ ? kStranger : Rejection(detail.has_value() ? detail->reason() : ""));
  Log(status, duration);
  return translate::ToGrpcStatus(status, call_.request_id);
}

void Request::Log(const absl::Status& status, absl::Duration duration) {
  std::optional<std::uint64_t> strangers;
  if (stranger_) {
    strangers = runtime_.strangers.ToLog(SteadyNow());
    if (!strangers.has_value()) return;
  }
  const auto add_who = [this, &status](LogLine& line) {
    line.Add("method", method_)
        .Add("code", absl::StatusCodeToString(status.code()))
        .Add("principal", call_.principal.empty() ? "-" : call_.principal);
    {
      absl::MutexLock lock(&mutex_);
      line.Add("map", has_map_ ? map_.substr(0, kMaxLoggedName) : "-")
          .Add("object", object_.empty() ? "-" : object_);
    }
    line.Add("peer", peer_).Add("id", call_.request_id);
  };
  LogLine call("call");
  add_who(call);
  call.Add("duration_ms", absl::ToInt64Milliseconds(duration))
      .Add("bytes_received", bytes_received_.load())
      .Add("bytes_sent", bytes_sent_.load());
  if (strangers.has_value()) call.Add("strangers", *strangers);
  if (!status.ok()) call.Add("message", status.message().substr(0, kMaxLoggedMessage));
  LOG(INFO) << call;
  const MethodRight* row = FindMethodRight(method_);
  if (stranger_ || row == nullptr || row->right == Right::kRead) return;
  LogLine audit("audit");
  add_who(audit);
  LOG(INFO) << audit;
}

}  // namespace strata::server
