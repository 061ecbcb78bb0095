// One request, one answer.
#ifndef STRATA_SERVER_RPC_UNARY_H_
#define STRATA_SERVER_RPC_UNARY_H_

#include <type_traits>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <grpcpp/support/server_callback.h>

#include "core/api/call.h"
#include "core/api/database.h"
#include "core/common/guarded.h"
#include "core/common/status.h"
#include "server/access/method_rights.h"
#include "server/access/right.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"

namespace strata::server {

template <typename In, typename Out>
using UnaryHandler = absl::Status (*)(api::Database&, const api::Call&, const In&, Out&);
// Answers a call whose answer depends on who asks.
template <typename In, typename Out>
using RequestHandler = absl::Status (*)(api::Database&, const Request&, const In&, Out&);

// Answers without waiting, on gRPC's own thread; false: it cannot, and the other handler does.
template <typename In, typename Out>
using AtHandHandler = absl::StatusOr<bool> (*)(api::Database&, const api::Call&, const In&, Out&);

// Lives from the call's arrival to its end; owns itself.
template <typename In, typename Out, typename Handler>
class UnaryReactor final : public grpc::ServerUnaryReactor {
 public:
  UnaryReactor(Runtime& runtime,
               grpc::CallbackServerContext& context,
               absl::string_view method,
               Sealed<In>& in,
               Out& out,
               Handler handler,
               AtHandHandler<In, Out> at_hand)
      : runtime_(runtime),
        request_(runtime, context, method, Request::Kind::kCall, LimitOf(runtime, method)),
        in_memory_(request_.NewBooking()),
        out_memory_(request_.NewBooking()),
        out_(out) {
    absl::StatusOr<bool> answered = false;
    const absl::Status status = Guarded([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.admission());
      STRATA_RETURN_IF_ERROR(request_.Open(in.bytes, in_, in_memory_));
      if (at_hand != nullptr) answered = at_hand(runtime_.db, request_.call(), in_, out_);
      return answered.status();
    });
    in.bytes.Clear();
    if (!status.ok() || *answered) {
      End(status);
    } else {
      runtime.queries.Submit(request_.client(), [this, handler] { Run(handler); });
    }
  }

 private:
  // What only reads may be asked again, for less. An edit waits for its map's worker as long as its
  // caller likes.
  static absl::Duration LimitOf(const Runtime& runtime, absl::string_view method) {
    const MethodRight* row = FindMethodRight(method);
    const bool reads = row != nullptr && row->right == Right::kRead;
    return reads ? runtime.options.max_query_time : absl::InfiniteDuration();
  }
  void Run(Handler handler) {
    End(Guarded([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(request_.call().stop.status());
      if constexpr (std::is_same_v<Handler, RequestHandler<In, Out>>) {
        return handler(runtime_.db, request_, in_, out_);
      } else {
        return handler(runtime_.db, request_.call(), in_, out_);
      }
    }));
  }
  void End(absl::Status status) {
    if (status.ok()) status = Request::HoldAnswer(out_, out_memory_);
    if (status.ok()) request_.CountSent(out_);
    Finish(request_.Close(request_.NameLimit(status)));
  }
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  Runtime& runtime_;
  Request request_;
  Booking in_memory_;
  Booking out_memory_;  // until the client has the answer
  In in_;
  Out& out_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_UNARY_H_
