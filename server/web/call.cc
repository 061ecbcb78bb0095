#include "server/web/call.h"

#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include <grpcpp/support/slice.h>

#include "server/access/access.h"
#include "server/rpc/request.h"

namespace strata::server::web {
namespace {

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return "";
  std::string bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

std::string RequestIdIn(const grpc::ClientContext& context) {
  const auto& metadata = context.GetServerInitialMetadata();
  const auto found = metadata.find(kRequestIdKey);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

}  // namespace

std::shared_ptr<OutgoingCall> OutgoingCall::Make(CallCount& count,
                                                 const CallHead& head,
                                                 absl::string_view request,
                                                 CallEvents events) {
  return std::shared_ptr<OutgoingCall>(new OutgoingCall(count, head, request, std::move(events)));
}

OutgoingCall::OutgoingCall(CallCount& count,
                           const CallHead& head,
                           absl::string_view request,
                           CallEvents events)
    : count_(count), path_(head.path), events_(std::move(events)) {
  const grpc::Slice slice(request.data(), request.size());
  request_ = grpc::ByteBuffer(&slice, 1);
  context_.AddMetadata(kWebPeerKey, head.peer);
  if (!head.authorization.empty()) context_.AddMetadata(kAuthorizationKey, head.authorization);
  if (!head.request_id.empty()) context_.AddMetadata(kRequestIdKey, head.request_id);
  if (head.timeout < absl::InfiniteDuration()) {
    context_.set_deadline(absl::ToChronoTime(absl::Now() + head.timeout));
  }
}

void OutgoingCall::Start(grpc::GenericStub& stub) {
  self_ = shared_from_this();
  count_.Begin();
  stub.PrepareBidiStreamingCall(&context_, path_, {}, this);
  AddHold();  // ReadNext() comes from elsewhere
  StartWriteLast(&request_, {});
  StartRead(&answer_);
  StartCall();
}

void OutgoingCall::ReadNext() {
  {
    absl::MutexLock lock(&mutex_);
    if (reading_ || ended_) return;
    reading_ = true;
  }
  StartRead(&answer_);
}

void OutgoingCall::Cancel() {
  {
    absl::MutexLock lock(&mutex_);
    if (std::exchange(cancelled_, true)) return;
  }
  context_.TryCancel();
  ReadNext();  // it fails, and with it the hold ends
}

void OutgoingCall::OnReadDone(bool ok) {
  bool cancelled = false;
  {
    absl::MutexLock lock(&mutex_);
    reading_ = false;
    ended_ = !ok;
    cancelled = cancelled_;
  }
  if (!ok) {
    RemoveHold();
  } else if (cancelled) {
    ReadNext();
  } else {
    events_.on_message(BytesOf(answer_));
  }
}

void OutgoingCall::OnDone(const grpc::Status& status) {
  {
    const CallEvents events = std::exchange(events_, {});
    events.on_end(status, RequestIdIn(context_));
  }
  CallCount& count = count_;
  self_.reset();
  count.End();
}

}  // namespace strata::server::web
