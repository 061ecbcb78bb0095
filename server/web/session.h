// One connection of HTTP/1.1: its requests one after the other, with bounds in bytes and time.
#ifndef STRATA_SERVER_WEB_SESSION_H_
#define STRATA_SERVER_WEB_SESSION_H_

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

// Boost 1.74's Asio uses std::exchange without it.
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>

#include "server/web/router.h"
#include "server/web/sessions.h"

namespace strata::server::web {

struct SessionLimits {
  std::size_t body_bytes = 4 << 20;
  // A body of more is booked with all others' (Sessions::TakeBytes).
  std::size_t small_body_bytes = 64 << 10;
  std::size_t header_bytes = 16 << 10;
  absl::Duration header_time = absl::Seconds(10);  // TLS and the first header
  absl::Duration idle_time = absl::Seconds(60);    // from an answer to the end of the next header
  absl::Duration body_time = absl::Seconds(60);
  // For which its reader may take nothing; a large piece may take longer.
  absl::Duration write_time = absl::Seconds(30);
};

// What sessions share; must outlive them.
struct SessionShared {
  const Router& router;
  Sessions& sessions;
  const SessionLimits limits;
  // Whether whoever shows this authorization may send a large body: UNAUTHENTICATED.
  const std::function<absl::Status(absl::string_view authorization)> known;
};

// A session of a connection that was accepted: `tls` null means plain text. It keeps itself alive
// and ends by itself; Start() once it was taken in.
class Session : public SessionBase {
 public:
  virtual void Start() = 0;
};
std::shared_ptr<Session> MakeSession(boost::asio::ip::tcp::socket socket,
                                     std::shared_ptr<boost::asio::ssl::context> tls,
                                     const SessionShared& shared);

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_SESSION_H_
