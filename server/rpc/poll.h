// One request, a stream of news.
#ifndef STRATA_SERVER_RPC_POLL_H_
#define STRATA_SERVER_RPC_POLL_H_

#include <cstddef>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"

namespace strata::server {

// Follows what changes without holding a thread a watcher: looks ten times a second, and less often
// where a look takes long, and sends what is new. The next look waits until gRPC has taken the
// message before, so a slow reader is told less often and costs one message. Lives from the call's
// arrival to its end; owns itself.
template <typename Asked, typename Told>
class PollReactor : public grpc::ServerWriteReactor<Told> {
 public:
  using In = Asked;
  using Out = Told;

  // Once, when construction has ended: a look is a virtual call.
  void Start() {
    if (!request_.admission().ok()) {
      sealed_.bytes.Clear();
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
              Sealed<In>& in)
      : runtime_(runtime),
        request_(runtime, context, method, Request::Kind::kWatch),
        asked_memory_(request_.NewBooking()),
        kept_memory_(request_.NewBooking()),
        out_memory_(request_.NewBooking()),
        sealed_(in) {}

  // What was asked, once and before the first look; keeps what it needs of `in`.
  virtual absl::Status Ask(const In& in) = 0;
  // One look, on a query thread; fills `out`, which is empty.
  virtual absl::StatusOr<News> Look(Out& out) = 0;
  // Memory that the looks have left behind, about [bytes].
  virtual std::size_t kept_bytes() const = 0;
  // Of watches whose clients would not come back by themselves: how long looks after the first may
  // go on to fail with UNAVAILABLE, where the store is away, say, before that ends the stream.
  virtual absl::Duration patience() const { return absl::ZeroDuration(); }
  // What a reader should know when the server shuts down.
  virtual absl::string_view shutdown_message() const = 0;

  Runtime& runtime() { return runtime_; }
  Request& request() { return request_; }

 private:
  // A watch spends at most one part in so many of a thread on looking.
  static constexpr int kRest = 20;

  // Then exactly one of: a message, a wait, the end.
  void LookAndSend() {
    const absl::Time begun = SteadyNow();
    if (news_ == News::kNone && begun < next_look_) {
      WaitAndLook();
      return;
    }
    const absl::Status status = Guarded([this]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      if (runtime_.shutting_down) {
        return translate::WithReason(absl::UnavailableError(shutdown_message()),
                                     translate::kShuttingDownReason);
      }
      STRATA_RETURN_IF_ERROR(asked_ ? request_.StillAllowed() : Open());
      STRATA_ASSIGN_OR_RETURN(news_, LookPatiently());
      STRATA_RETURN_IF_ERROR(kept_memory_.Resize(kept_bytes()));
      return news_ == News::kNone ? absl::OkStatus() : Request::HoldAnswer(out_, out_memory_);
    });
    next_look_ = SteadyNow() + kRest * (SteadyNow() - begun);
    if (!status.ok()) {
      this->Finish(request_.Close(status));
    } else if (news_ == News::kNone) {
      WaitAndLook();
    } else {
      request_.CountSent(out_);
      this->StartWrite(&out_);
    }
  }

  absl::StatusOr<News> LookPatiently() {
    absl::StatusOr<News> news = Look(out_);
    if (!absl::IsUnavailable(news.status())) {
      looked_ = looked_ || news.ok();
      failing_since_.reset();
      return news;
    }
    if (!failing_since_.has_value()) failing_since_ = SteadyNow();
    if (!looked_ || SteadyNow() - *failing_since_ >= patience()) return news;
    out_ = Out();
    return News::kNone;
  }

  absl::Status Open() {
    In in;
    STRATA_RETURN_IF_ERROR(request_.Open(sealed_.bytes, in, asked_memory_));
    STRATA_RETURN_IF_ERROR(Ask(in));
    asked_memory_.Release();
    asked_ = true;
    return absl::OkStatus();
  }

  void WaitAndLook() {
    runtime_.ticker.AtNextTick(request_.client(), [this] { LookAndSend(); });
  }

  void OnWriteDone(bool ok) override {
    // A watcher to whom nothing is told keeps nothing.
    out_ = Out();
    out_memory_.Release();
    const News sent = std::exchange(news_, News::kNone);
    if (!ok) {
      this->Finish(request_.Close(absl::CancelledError("the reader has gone")));
    } else if (sent == News::kLast) {
      this->Finish(request_.Close(absl::OkStatus()));
    } else if (sent == News::kMore) {
      next_look_ = absl::InfinitePast();
      runtime_.queries.Submit(request_.client(), [this] { LookAndSend(); });
    } else {
      WaitAndLook();
    }
  }
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  Runtime& runtime_;
  Request request_;
  Booking asked_memory_;
  Booking kept_memory_;
  Booking out_memory_;
  Sealed<In>& sealed_;
  bool asked_ = false;
  bool looked_ = false;
  std::optional<absl::Time> failing_since_;
  Out out_;
  News news_ = News::kNone;
  absl::Time next_look_ = absl::InfinitePast();
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_POLL_H_
