// A client of HTTP/1.1 for tests, that says exactly what it is told to.
#ifndef STRATA_TESTS_SERVER_WEB_HTTP_CLIENT_H_
#define STRATA_TESTS_SERVER_WEB_HTTP_CLIENT_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace strata::server::web {

using Headers = std::vector<std::pair<std::string, std::string>>;

struct HttpAnswer {
  int status = 0;                              // 0: the connection ended without an answer
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;                            // of chunks put together
};

// One connection, blocking.
class HttpConnection {
 public:
  // `url`: http://127.0.0.1:PORT. `receive_bytes`: what the system takes in that was not read; 0:
  // as much as it likes.
  explicit HttpConnection(const std::string& url, int receive_bytes = 0);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  // As it is; false once the other side has closed.
  bool Say(absl::string_view bytes);
  // A request with a Host of this server unless there is one among `headers`, and its length.
  bool Ask(const std::string& verb,
           const std::string& target,
           const Headers& headers = {},
           const std::string& body = "");
  // The next answer, whole; after `patience` without a byte what came until then.
  HttpAnswer Take(absl::Duration patience = absl::Seconds(10), bool to_head = false);
  // What has come and is in no answer yet; waits for `enough` bytes.
  std::string TakeBytes(std::size_t enough, absl::Duration patience = absl::Seconds(10));
  // Whether the other side closes within `patience`.
  bool IsClosed(absl::Duration patience);

 private:
  // False: nothing came, or the end.
  bool Receive(absl::Duration patience);
  std::string TakeLine(absl::Duration patience);

  int socket_ = -1;
  std::string host_;
  std::string bytes_;  // not taken yet
};

// One request on a connection of its own.
HttpAnswer AskOnce(const std::string& url,
                   const std::string& verb,
                   const std::string& target,
                   const Headers& headers = {},
                   const std::string& body = "");

}  // namespace strata::server::web

#endif  // STRATA_TESTS_SERVER_WEB_HTTP_CLIENT_H_
