// A stream of requests that make up one, and one answer.
#ifndef STRATA_SERVER_RPC_COLLECT_H_
#define STRATA_SERVER_RPC_COLLECT_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"

namespace strata::server {

// Reads a message only when the one before is dealt with; memory is what `Collector` keeps, which
// it must bound and book. `Collector` has In and Out, and
//   absl::Status Take(api::Database&, const api::Call&, const In&, Booking&)  on an upload thread
//   absl::Status Finish(api::Database&, const api::Call&, Out&)  on a query thread, at the end
// called one at a time; the booking, always the same, is for what it keeps. Lives from the call's
// arrival to its end; owns itself.
template <typename Collector>
class CollectReactor final : public grpc::ServerReadReactor<Sealed<typename Collector::In>> {
 public:
  using In = typename Collector::In;
  using Out = typename Collector::Out;

  CollectReactor(Runtime& runtime,
                 grpc::CallbackServerContext& context,
                 absl::string_view method,
                 Out& out)
      : runtime_(runtime),
        request_(runtime, context, method),
        in_memory_(request_.NewBooking()),
        kept_memory_(request_.NewBooking()),
        out_memory_(request_.NewBooking()),
        out_(out),
        expected_(runtime.silence, request_.call().stop, [this](const absl::Status& status) {
          this->Finish(request_.Close(status));
        }) {
    if (!request_.admission().ok()) {
      this->Finish(request_.Close(request_.admission()));
      return;
    }
    Read();
  }

 private:
  void Read() {
    expected_.Expect();
    this->StartRead(&message_);
  }
  void OnReadDone(bool ok) override {
    if (!expected_.Arrived()) return;
    if (ok) {
      runtime_.uploads.Submit(request_.client(), [this] { Take(); });
    } else {
      runtime_.queries.Submit(request_.client(), [this] { End(); });
    }
  }
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  void Take() {
    const absl::Status status = Guarded([this]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      In in;
      STRATA_RETURN_IF_ERROR(request_.Open(message_.bytes, in, in_memory_));
      return collector_.Take(runtime_.db, request_.call(), in, kept_memory_);
    });
    in_memory_.Release();
    if (status.ok()) {
      Read();
    } else {
      this->Finish(request_.Close(status));
    }
  }

  void End() {
    const absl::Status status = Guarded([this]() -> absl::Status {
      // The stream also ends when the client has gone.
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      STRATA_RETURN_IF_ERROR(request_.StillAllowed());
      STRATA_RETURN_IF_ERROR(collector_.Finish(runtime_.db, request_.call(), out_));
      return Request::HoldAnswer(out_, out_memory_);
    });
    request_.CountSent(out_);
    this->Finish(request_.Close(status));
  }

  Runtime& runtime_;
  Request request_;
  Booking in_memory_;
  Booking kept_memory_;
  Booking out_memory_;
  Out& out_;
  Sealed<In> message_;
  Collector collector_;
  ExpectedMessage expected_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_COLLECT_H_
