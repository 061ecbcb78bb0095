// Calls of the contract by POST: Connect (unary and streams of answers, JSON and protobuf) and
// gRPC-Web.
#ifndef STRATA_SERVER_WEB_RPC_H_
#define STRATA_SERVER_WEB_RPC_H_

#include <memory>
#include <optional>

#include <grpcpp/generic/generic_stub.h>

#include "server/web/call.h"
#include "server/web/contract.h"
#include "server/web/exchange.h"

namespace strata::server::web {

// Authorization, id, peer and deadline of a question for `path`. INVALID_ARGUMENT for a time that
// is none; UNAUTHENTICATED for an authorization that no header of gRPC can hold.
absl::StatusOr<CallHead> CallHeadOf(const Question& question, std::string path);

// Thread-safe.
class Rpc {
 public:
  // All must outlive it.
  Rpc(const Contract& contract, grpc::GenericStub& stub, CallCount& count)
      : contract_(contract), stub_(stub), count_(count) {}

  // What is wrong with a POST, before its body is read: 404 for a path without a method, 415 for a
  // type of content that none of the protocols has (forms of any page's have none of these), 501
  // for a stream of requests.
  std::optional<Answer> Refuse(const Question& question) const;
  // Of a question that was not refused. Null: answered at once.
  std::shared_ptr<Exchange> Handle(const Question& question,
                                   const std::shared_ptr<AnswerSink>& sink) const;

 private:
  const Contract& contract_;
  grpc::GenericStub& stub_;
  CallCount& count_;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_RPC_H_
