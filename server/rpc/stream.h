// One request, a stream of answers.
#ifndef STRATA_SERVER_RPC_STREAM_H_
#define STRATA_SERVER_RPC_STREAM_H_

#include <cstddef>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "core/api/call.h"
#include "core/api/database.h"
#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/steady_time.h"
#include "server/rpc/reader_pace.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"

namespace strata::server {

// Sends one message; returns when gRPC has taken it and it is this stream's turn again, an error
// when the reader is gone or too slow. No mutex may be held.
template <typename Out>
using StreamSink = absl::FunctionRef<absl::Status(const Out&)>;

template <typename In, typename Out>
using StreamHandler =
    absl::Status (*)(api::Database&, const api::Call&, const In&, StreamSink<Out>);

// Lives from the call's arrival to its end; owns itself. The handler has a thread, since the
// database delivers into a sink, but its place among the runtime's streams only while it does not
// wait for its reader. Memory is one message a stream.
template <typename In, typename Out>
class StreamReactor final : public grpc::ServerWriteReactor<Out> {
 public:
  StreamReactor(Runtime& runtime,
                grpc::CallbackServerContext& context,
                absl::string_view method,
                Sealed<In>& in,
                StreamHandler<In, Out> handler)
      : runtime_(runtime),
        context_(context),
        request_(runtime, context, method),
        memory_(request_.NewBooking()),
        out_memory_(request_.NewBooking()),
        sealed_(in),
        pace_(runtime.options.slow_reader_timeout) {
    if (!request_.admission().ok()) {
      sealed_.bytes.Clear();
      this->Finish(request_.Close(request_.admission()));
      return;
    }
    runtime.streams.Submit(request_.client(), [this, handler] { Run(handler); });
  }

 private:
  void Run(StreamHandler<In, Out> handler) {
    const absl::Status status = Guarded([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      In in;
      STRATA_RETURN_IF_ERROR(request_.Open(sealed_.bytes, in, memory_));
      return handler(
          runtime_.db, request_.call(), in, [this](const Out& message) { return Send(message); });
    });
    this->Finish(request_.Close(status));
  }

  absl::Status Send(const Out& message) {
    STRATA_RETURN_IF_ERROR(request_.call().stop.status());
    STRATA_RETURN_IF_ERROR(request_.StillAllowed());
    STRATA_RETURN_IF_ERROR(Request::HoldAnswer(message, out_memory_));
    {
      absl::MutexLock lock(&mutex_);
      sending_ = true;
    }
    request_.CountSent(message);
    const std::size_t bytes = message.ByteSizeLong();
    this->StartWrite(&message);
    const BlockingScope blocking(/*in_turn=*/true);
    absl::MutexLock lock(&mutex_);
    const auto sent = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !sending_; };
    const absl::Time begun = SteadyNow();
    const absl::Time until = begun + pace_.patience();
    // A clock that is set forward ends a wait early.
    while (!mutex_.AwaitWithTimeout(absl::Condition(&sent), until - SteadyNow()) &&
           SteadyNow() < until) {
    }
    if (sending_) {
      // gRPC reads `message` until the write ends, and only the end of the call ends it now.
      context_.TryCancel();
      mutex_.Await(absl::Condition(&sent));
      return TooSlow();
    }
    pace_.Took(bytes, SteadyNow() - begun);
    return send_ok_ ? absl::OkStatus() : absl::CancelledError("the reader has gone");
  }

  absl::Status TooSlow() const {
    return translate::WithReason(absl::DeadlineExceededError(absl::StrCat(
                                     "the reader fell ",
                                     absl::FormatDuration(runtime_.options.slow_reader_timeout),
                                     " behind ",
                                     ReaderPace::kLeastBytesPerSecond >> 10,
                                     " KiB/s; read faster, or ask for less")),
                                 translate::kSlowReaderReason);
  }

  void OnWriteDone(bool ok) override {
    absl::MutexLock lock(&mutex_);
    sending_ = false;
    send_ok_ = ok;
  }
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  Runtime& runtime_;
  grpc::CallbackServerContext& context_;
  Request request_;
  Booking memory_;      // of the request
  Booking out_memory_;  // of the message that is sent, or was sent last
  Sealed<In>& sealed_;
  ReaderPace pace_;
  absl::Mutex mutex_;
  bool sending_ ABSL_GUARDED_BY(mutex_) = false;
  bool send_ok_ ABSL_GUARDED_BY(mutex_) = true;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_STREAM_H_
