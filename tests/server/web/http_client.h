// A client of HTTP/1.1 for tests, that says exactly what it is told to.
#ifndef STRATA_TESTS_SERVER_WEB_HTTP_CLIENT_H_
#define STRATA_TESTS_SERVER_WEB_HTTP_CLIENT_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "tests/support/patience.h"

namespace strata::server::web {

using Headers = std::vector<std::pair<std::string, std::string>>;

struct HttpAnswer {
  int status = 0;                              // 0: the connection ended without an answer
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;                            // of chunks put together
};

// How long a test waits for what is to come. No promise of the server's, which is faster, but
// longer than a loaded machine stands still.

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
  // The next answer, whole; where nothing more comes what came until then.
  HttpAnswer Take(bool to_head = false);
  // What has come and is in no answer yet, once `text` is in it; without `text` where nothing more
  // comes.
  std::string TakeUntil(absl::string_view text);
  // Whether the other side closes within `patience`.
  bool IsClosed(absl::Duration patience = testing::kPatience);

 private:
  // False: nothing came, or the end.
  bool Receive();
  std::string TakeLine();
  std::string TakeBytes(std::size_t count);

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
