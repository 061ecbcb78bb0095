// A service of the contract, whose methods get their requests sealed.
#ifndef STRATA_SERVER_RPC_SERVICE_H_
#define STRATA_SERVER_RPC_SERVICE_H_

#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <grpcpp/impl/codegen/proto_utils.h>  // what sends answers
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/impl/rpc_method.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/support/server_callback.h>

#include "server/rpc/collect.h"
#include "server/rpc/poll.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"
#include "server/rpc/stream.h"
#include "server/rpc/unary.h"

namespace strata::server {

// What the generated CallbackService is for other servers, but that a stranger's bytes are not
// parsed: it has its methods from a table, which a subclass fills in its constructor. Thread-safe
// from then on.
class Service : public grpc::Service {
 protected:
  // `name` as in "Maps".
  Service(Runtime& runtime, absl::string_view name) : runtime_(runtime), name_(name) {}

  // Each: `method` as in "Create", answered on one of the runtime's threads as the header of the
  // reactor says.
  template <typename In, typename Out>
  void Unary(absl::string_view method,
             UnaryHandler<In, Out> handler,
             AtHandHandler<In, Out> at_hand = nullptr) {
    AddUnary<In, Out>(method, handler, at_hand);
  }
  template <typename In, typename Out>
  void Unary(absl::string_view method, RequestHandler<In, Out> handler) {
    AddUnary<In, Out>(method, handler, nullptr);
  }
  template <typename In, typename Out>
  void Stream(absl::string_view method, StreamHandler<In, Out> handler) {
    const absl::string_view full = FullName(method);
    Add<grpc::internal::CallbackServerStreamingHandler<Sealed<In>, Out>>(
        method,
        grpc::internal::RpcMethod::SERVER_STREAMING,
        [this, full, handler](grpc::CallbackServerContext* context, const Sealed<In>* in) {
          return new StreamReactor<In, Out>(runtime_, *context, full, Opened(in), handler);
        });
  }
  // `Reactor` is a PollReactor.
  template <typename Reactor>
  void Poll(absl::string_view method) {
    using In = typename Reactor::In;
    Add<grpc::internal::CallbackServerStreamingHandler<Sealed<In>, typename Reactor::Out>>(
        method,
        grpc::internal::RpcMethod::SERVER_STREAMING,
        [this](grpc::CallbackServerContext* context, const Sealed<In>* in) {
          auto* reactor = new Reactor(runtime_, *context, Opened(in));
          reactor->Start();
          return reactor;
        });
  }
  template <typename Collector>
  void Collect(absl::string_view method) {
    const absl::string_view full = FullName(method);
    using Reactor = CollectReactor<Collector>;
    Add<grpc::internal::CallbackClientStreamingHandler<Sealed<typename Reactor::In>,
                                                       typename Reactor::Out>>(
        method,
        grpc::internal::RpcMethod::CLIENT_STREAMING,
        [this, full](grpc::CallbackServerContext* context, typename Reactor::Out* out) {
          return new Reactor(runtime_, *context, full, *out);
        });
  }
  // A stream of requests with a reactor of its own.
  template <typename Reactor>
  void Receive(absl::string_view method) {
    using Out = typename Reactor::Out;
    Add<grpc::internal::CallbackClientStreamingHandler<Sealed<typename Reactor::In>, Out>>(
        method,
        grpc::internal::RpcMethod::CLIENT_STREAMING,
        [this](grpc::CallbackServerContext* context, Out* out) {
          return new Reactor(runtime_, *context, *out);
        });
  }
  // A stream both ways.
  template <typename Reactor>
  void Exchange(absl::string_view method) {
    Add<grpc::internal::CallbackBidiHandler<Sealed<typename Reactor::In>, typename Reactor::Out>>(
        method,
        grpc::internal::RpcMethod::BIDI_STREAMING,
        [this](grpc::CallbackServerContext* context) { return new Reactor(runtime_, *context); });
  }

 private:
  // gRPC hands its own message out as const; here it is emptied as soon as it was read or refused.
  template <typename In>
  static Sealed<In>& Opened(const Sealed<In>* in) {
    return const_cast<Sealed<In>&>(*in);
  }

  template <typename In, typename Out, typename Handler>
  void AddUnary(absl::string_view method, Handler handler, AtHandHandler<In, Out> at_hand) {
    const absl::string_view full = FullName(method);
    Add<grpc::internal::CallbackUnaryHandler<Sealed<In>, Out>>(
        method,
        grpc::internal::RpcMethod::NORMAL_RPC,
        [this, full, handler, at_hand](
            grpc::CallbackServerContext* context, const Sealed<In>* in, Out* out) {
          return new UnaryReactor<In, Out, Handler>(
              runtime_, *context, full, Opened(in), *out, handler, at_hand);
        });
  }
  template <typename Handler, typename MakeReactor>
  void Add(absl::string_view method,
           grpc::internal::RpcMethod::RpcType type,
           MakeReactor make_reactor) {
    const std::string& path = names_.emplace_back(absl::StrCat("/strata.v1.", name_, "/", method));
    AddMethod(new grpc::internal::RpcServiceMethod(path.c_str(), type, nullptr));
    MarkMethodCallback(count_++, new Handler(std::move(make_reactor)));
  }
  // As in "Maps.Create".
  absl::string_view FullName(absl::string_view method) {
    return names_.emplace_back(absl::StrCat(name_, ".", method));
  }

  Runtime& runtime_;
  const std::string name_;
  std::deque<std::string> names_;  // gRPC and the reactors keep views
  int count_ = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_SERVICE_H_
