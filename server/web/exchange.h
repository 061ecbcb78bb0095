// A request of HTTP, its answer, and what is under way between the two; without sockets.
#ifndef STRATA_SERVER_WEB_EXCHANGE_H_
#define STRATA_SERVER_WEB_EXCHANGE_H_

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include <grpcpp/support/status.h>

#include "server/web/wire.h"

namespace strata::server::web {

struct Question {
  std::string verb;                                         // as in "GET"
  std::string path;                                         // as it came, before any "?"
  std::string query;                                        // behind it
  std::map<std::string, std::string, std::less<>> headers;  // names in lower case
  std::string body;
  std::string peer;  // as gRPC names one: "ipv4:192.0.2.7:40001"

  // Empty without it.
  absl::string_view Header(absl::string_view name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? absl::string_view() : absl::string_view(found->second);
  }
};

struct Answer {
  int status = 200;
  // Names and values of ours, or checked: no line ends in them.
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
};

// As a unary call of Connect ends with an error.
Answer ErrorAnswer(const grpc::Status& status);
// The same with another status of HTTP.
Answer ErrorAnswer(int http_status, grpc::StatusCode code, const std::string& message);

// Where the answer to one question goes: Send(), or Begin(), any number of Write() and End(). From
// any thread; where the client has gone nothing happens, and `taken` is never called.
class AnswerSink {
 public:
  virtual ~AnswerSink() = default;
  virtual void Send(Answer answer) = 0;
  // The body of `head` is not looked at.
  virtual void Begin(Answer head) = 0;
  // `taken`: it is on its way, and the next may come.
  virtual void Write(std::string piece, std::function<void()> taken) = 0;
  virtual void End(std::string last) = 0;
};

// What is under way for a question. Thread-safe.
class Exchange {
 public:
  virtual ~Exchange() = default;
  // The client has gone.
  virtual void Cancel() = 0;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_EXCHANGE_H_
