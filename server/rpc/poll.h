// One request, a stream of news.
#ifndef STRATA_SERVER_RPC_POLL_H_
#define STRATA_SERVER_RPC_POLL_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "core/common/status.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// Follows what changes without holding a thread a watcher: looks ten times a second and sends what
// is new. The next look waits until gRPC has taken the message before, so a slow reader is told
// less often and costs one message. Lives from the call's arrival to its end; owns itself.
template <typename Out>
class PollReactor : public grpc::ServerWriteReactor<Out> {
 public:
  // Once, when construction has ended: a look is a virtual call.
  void Start() {
    if (!request_.admission().ok()) {
      this->Finish(request_.Close(request_.admission()));
      return;
    }
    runtime_.queries.Submit(request_.client(), [this] { LookAndSend(); });
  }

 protected:
  // What a look found.
  enum class News {
    kNone,
    kSome,  // to be sent; look again later
    kMore,  // to be sent; there is more at once
    kLast,  // to be sent, and the stream ends
  };

  // `method` as in "Jobs.Watch"; it and `in`, what was asked, must outlive the reactor.
  PollReactor(Runtime& runtime,
              grpc::CallbackServerContext& context,
              absl::string_view method,
              const google::protobuf::Message& in)
      : runtime_(runtime), request_(runtime, context, method, Request::Kind::kWatch), asked_(in) {}

  // One look, on a query thread. `out` holds what was sent last, and then what is to be sent.
  virtual absl::StatusOr<News> Look(Out& out) = 0;
  // What a reader should know when the server shuts down.
  virtual absl::string_view shutdown_message() const = 0;

  Runtime& runtime() { return runtime_; }
  Request& request() { return request_; }

 private:
  // Then exactly one of: a message, a wait, the end.
  void LookAndSend() {
    const absl::Status status = Guarded([this]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      if (runtime_.shutting_down) {
        return translate::WithReason(absl::UnavailableError(shutdown_message()),
                                     translate::kShuttingDownReason);
      }
      STRATA_RETURN_IF_ERROR(received_ ? request_.StillAllowed() : request_.Receive(asked_));
      received_ = true;
      STRATA_ASSIGN_OR_RETURN(news_, Look(out_));
      return absl::OkStatus();
    });
    if (!status.ok()) {
      this->Finish(request_.Close(status));
    } else if (news_ == News::kNone) {
      WaitAndLook();
    } else {
      request_.CountSent(out_);
      this->StartWrite(&out_);
    }
  }

  void WaitAndLook() {
    runtime_.ticker.AtNextTick(request_.client(), [this] { LookAndSend(); });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) {
      this->Finish(request_.Close(absl::CancelledError("the reader has gone")));
    } else if (news_ == News::kLast) {
      this->Finish(request_.Close(absl::OkStatus()));
    } else if (news_ == News::kMore) {
      runtime_.queries.Submit(request_.client(), [this] { LookAndSend(); });
    } else {
      WaitAndLook();
    }
  }
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  Runtime& runtime_;
  Request request_;
  const google::protobuf::Message& asked_;
  bool received_ = false;
  Out out_;
  News news_ = News::kNone;
};

// Answers with what a `Reactor` sends.
template <typename Reactor, typename In>
Reactor* StartPolling(Runtime& runtime, grpc::CallbackServerContext& context, const In& in) {
  auto* reactor = new Reactor(runtime, context, in);
  reactor->Start();
  return reactor;
}

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_POLL_H_
