// The HTTP door of a server: browsers and whoever speaks JSON reach the same services as gRPC.
#ifndef STRATA_SERVER_WEB_WEB_SERVER_H_
#define STRATA_SERVER_WEB_WEB_SERVER_H_

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <grpcpp/channel.h>

#include "core/common/host_port.h"
#include "server/tls.h"

namespace strata::server::web {

struct WebServerOptions {
  HostPort listen;
  std::vector<std::string> names;  // by which browsers may reach it, beside localhost and addresses
  std::filesystem::path viewer;    // folder of the viewer's files; empty: none
  TlsFiles tls;
  std::size_t max_body_bytes = 4 << 20;
  std::size_t max_bodies_bytes = std::size_t{160}
                                 << 20;  // of all large bodies on their way in or out
  std::size_t max_connections = 4096;
  absl::Duration slow_sender_timeout = absl::Seconds(60);  // for a body
  absl::Duration slow_reader_timeout = absl::Seconds(30);
  std::vector<std::string> services;  // full names
  // Whether whoever shows this authorization is known: UNAUTHENTICATED.
  std::function<absl::Status(absl::string_view authorization)> known;
};

// Serves until Close(). Thread-safe.
class WebServer {
 public:
  // `channel`: to the services, within this process. UNAVAILABLE if nothing can be listened on;
  // what Pages::Make and the certificate's files answer.
  static absl::StatusOr<std::unique_ptr<WebServer>> Open(WebServerOptions options,
                                                         std::shared_ptr<grpc::Channel> channel);
  virtual ~WebServer() = default;  // closes

  // http://HOST:PORT with the true port.
  virtual const std::string& url() const = 0;
  // Nobody connects from now on; what is under way goes on.
  virtual void StopAccepting() = 0;
  // Ends all connections and calls. Again: nothing.
  virtual void Close() = 0;

  virtual std::size_t connections() const = 0;
  // Connections that were sent away or ended for want of room.
  virtual std::uint64_t refused() const = 0;
  // Calls of browsers under way, streams included.
  virtual int calls() const = 0;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_WEB_SERVER_H_
