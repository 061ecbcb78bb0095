#include "server/web/rpc.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/rpc/request.h"

namespace strata::server::web {
namespace {

namespace pb = google::protobuf;

enum class Protocol { kConnectUnary, kConnectStream, kGrpcWeb };

struct ContentType {
  absl::string_view name;
  Protocol protocol;
  bool json;
};

// None is among those that a form or a script of another site's page may send without being asked
// about (CORS-safelisted).
constexpr std::array<ContentType, 6> kContentTypes = {
    {{"application/json", Protocol::kConnectUnary, true},
     {"application/proto", Protocol::kConnectUnary, false},
     {"application/connect+json", Protocol::kConnectStream, true},
     {"application/connect+proto", Protocol::kConnectStream, false},
     {"application/grpc-web+proto", Protocol::kGrpcWeb, false},
     {"application/grpc-web", Protocol::kGrpcWeb, false}}};

const ContentType* ContentTypeOf(const Question& question) {
  absl::string_view text = question.Header("content-type");
  text = absl::StripAsciiWhitespace(text.substr(0, text.find(';')));
  for (const ContentType& type : kContentTypes) {
    if (absl::EqualsIgnoreCase(text, type.name)) return &type;
  }
  return nullptr;
}

std::string KnownTypes() {
  return absl::StrJoin(kContentTypes, ", ", [](std::string* out, const ContentType& type) {
    out->append(type.name.data(), type.name.size());
  });
}

// What gRPC takes for a value; it aborts at others.
bool IsHeaderText(absl::string_view value) {
  return std::all_of(
      value.begin(), value.end(), [](unsigned char c) { return absl::ascii_isprint(c); });
}

absl::StatusOr<absl::Duration> TimeoutOf(const Question& question) {
  if (const absl::string_view text = question.Header("connect-timeout-ms"); !text.empty()) {
    return ParseConnectTimeout(text);
  }
  if (const absl::string_view text = question.Header("grpc-timeout"); !text.empty()) {
    return ParseGrpcTimeout(text);
  }
  return absl::InfiniteDuration();
}

grpc::Status ToGrpc(const absl::Status& status) {
  return translate::ToGrpcStatus(translate::WithReason(status, translate::kRequestReason), "");
}

// One call of one of the protocols: what both sides of it have in common.
struct Talk {
  const Contract& contract;
  const pb::MethodDescriptor& method;
  const ContentType& type;
  std::shared_ptr<AnswerSink> sink;

  // The request's bytes.
  absl::StatusOr<std::string> RequestOf(const Question& question) const {
    absl::string_view message = question.body;
    if (type.protocol != Protocol::kConnectUnary) {
      STRATA_ASSIGN_OR_RETURN(message, OnlyMessage(question.body));
    }
    if (!type.json) return std::string(message);
    return contract.FromJson(*method.input_type(), message);
  }
  // A message of the answer as the client reads it.
  absl::StatusOr<std::string> Body(const std::string& bytes) const {
    if (!type.json) return bytes;
    return contract.ToJson(*method.output_type(), bytes);
  }
  std::string Last(const grpc::Status& status) const {
    return type.protocol == Protocol::kGrpcWeb ? WebTrailers(status) : ConnectEnd(status);
  }
  Answer Head() const {
    return {200, {{"Content-Type", std::string(type.name)}, {"Cache-Control", "no-store"}}, ""};
  }
  void Refuse(const absl::Status& status) const {
    if (type.protocol == Protocol::kConnectUnary) {
      sink->Send(ErrorAnswer(ToGrpc(status)));
      return;
    }
    sink->Begin(Head());
    sink->End(Last(ToGrpc(status)));
  }
};

// Collects the one answer.
CallEvents UnaryEvents(const Talk& talk, const std::shared_ptr<std::weak_ptr<OutgoingCall>>& call) {
  const auto answer = std::make_shared<std::string>();
  CallEvents events;
  events.on_message = [answer, call](std::string bytes) {
    *answer = std::move(bytes);
    if (const auto held = call->lock()) held->ReadNext();
  };
  events.on_end = [talk, answer](const grpc::Status& status, const std::string& request_id) {
    Answer reply;
    if (!status.ok()) {
      reply = ErrorAnswer(status);
    } else if (absl::StatusOr<std::string> body = talk.Body(*answer); body.ok()) {
      reply = talk.Head();
      reply.body = *std::move(body);
    } else {
      reply = ErrorAnswer(ToGrpc(body.status()));
    }
    if (!request_id.empty()) reply.headers.emplace_back(kRequestIdKey, request_id);
    talk.sink->Send(std::move(reply));
  };
  return events;
}

// Passes messages on as they are taken.
CallEvents StreamEvents(const Talk& talk,
                        const std::shared_ptr<std::weak_ptr<OutgoingCall>>& call) {
  // Why the rest cannot be told.
  const auto broken = std::make_shared<absl::Status>();
  CallEvents events;
  events.on_message = [talk, call, broken](std::string bytes) {
    absl::StatusOr<std::string> body = talk.Body(bytes);
    const auto held = call->lock();
    if (held == nullptr) return;
    if (!body.ok()) {
      *broken = body.status();
      held->Cancel();
      return;
    }
    talk.sink->Write(Envelope(kMessage, *body), [held] { held->ReadNext(); });
  };
  events.on_end = [talk, broken](const grpc::Status& status, const std::string& /*request_id*/) {
    talk.sink->End(talk.Last(broken->ok() ? status : ToGrpc(*broken)));
  };
  return events;
}

}  // namespace

absl::StatusOr<CallHead> CallHeadOf(const Question& question, std::string path) {
  CallHead head;
  head.path = std::move(path);
  head.peer = question.peer;
  STRATA_ASSIGN_OR_RETURN(head.timeout, TimeoutOf(question));
  const absl::string_view authorization = question.Header("authorization");
  if (!IsHeaderText(authorization)) {
    return absl::UnauthenticatedError("the authorization has characters that no token has");
  }
  head.authorization = std::string(authorization);
  const absl::string_view id = question.Header(kRequestIdKey);
  if (IsHeaderText(id)) head.request_id = std::string(id);
  return head;
}

std::optional<Answer> Rpc::Refuse(const Question& question) const {
  const pb::MethodDescriptor* method = contract_.Find(question.path);
  if (method == nullptr) {
    return ErrorAnswer(
        404, grpc::UNIMPLEMENTED, "this server has no such method; see /openapi.json");
  }
  const ContentType* type = ContentTypeOf(question);
  if (type == nullptr) {
    Answer answer = ErrorAnswer(
        415, grpc::INVALID_ARGUMENT, absl::StrCat("content-type must be one of ", KnownTypes()));
    answer.headers.emplace_back("Accept-Post", KnownTypes());
    return answer;
  }
  const absl::string_view packed = question.Header("content-encoding");
  if (!packed.empty() && !absl::EqualsIgnoreCase(packed, "identity")) {
    return ErrorAnswer(415, grpc::UNIMPLEMENTED, "content-encoding must be identity");
  }
  if (method->client_streaming()) {
    return ErrorAnswer(501,
                       grpc::UNIMPLEMENTED,
                       absl::StrCat(method->full_name(), " takes a stream of requests: use gRPC"));
  }
  if (method->server_streaming() && type->protocol == Protocol::kConnectUnary) {
    return ErrorAnswer(415,
                       grpc::INVALID_ARGUMENT,
                       absl::StrCat(method->full_name(),
                                    " answers by a stream: content-type must be "
                                    "application/connect+json, application/connect+proto or "
                                    "application/grpc-web+proto, the body one envelope"));
  }
  return std::nullopt;
}

std::shared_ptr<Exchange> Rpc::Handle(const Question& question,
                                      const std::shared_ptr<AnswerSink>& sink) const {
  const Talk talk{contract_, *contract_.Find(question.path), *ContentTypeOf(question), sink};
  const absl::StatusOr<CallHead> head = CallHeadOf(question, question.path);
  const absl::StatusOr<std::string> request =
      head.ok() ? talk.RequestOf(question) : absl::StatusOr<std::string>(head.status());
  if (!request.ok()) {
    talk.Refuse(request.status());
    return nullptr;
  }
  const bool unary = talk.type.protocol == Protocol::kConnectUnary;
  const auto call = std::make_shared<std::weak_ptr<OutgoingCall>>();
  if (!unary) sink->Begin(talk.Head());
  const auto made = OutgoingCall::Make(
      count_, *head, *request, unary ? UnaryEvents(talk, call) : StreamEvents(talk, call));
  *call = made;
  made->Start(stub_);
  return made;
}

}  // namespace strata::server::web
