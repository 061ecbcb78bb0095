// The gRPC server around a database.
#ifndef STRATA_SERVER_SERVER_H_
#define STRATA_SERVER_SERVER_H_

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/api/database.h"
#include "server/readiness.h"
#include "server/rpc/client_limits.h"
#include "server/tls.h"

namespace strata::server {

struct ServerOptions {
  std::string listen = "127.0.0.1:50051";  // HOST:PORT; port 0: any free one
  // Listen beyond loopback although not all is encrypted, or nobody is asked who he is.
  bool insecure = false;
  TlsFiles tls;                      // empty: plain text
  std::filesystem::path token_file;  // who may do what (token_file.h); empty: everybody everything
  // HOST:PORT that answers Prometheus at /metrics, in plain text and to anybody; empty: none.
  std::string metrics_listen;
  // HTTP, for browsers and JSON; see docs/web.md.
  std::string web_listen;              // HOST:PORT; empty: none
  std::vector<std::string> web_names;  // by which browsers may reach it, beside localhost and IPs
  std::filesystem::path web_viewer;    // folder of the viewer's files; empty: none
  int query_threads = 8;               // calls answered at a time; in [1, 1000]
  int stream_threads = 8;              // listings and downloads served at a time; in [1, 1000]
  // A unary call that only reads ends after so long, whatever its caller allows (Localize is none).
  absl::Duration max_query_time = absl::Seconds(30);
  int upload_threads = 16;  // scans taken in at a time; in [1, 1000]
  // Calls under way, streams included but watches of maps and jobs, which cost little and have a
  // limit of their own; more are told to come back. In [1, 1'000'000].
  int max_calls = 1024;
  int max_watches = 4096;
  ClientLimitOptions client;        // the same for one client, and how often it may call
  int max_message_bytes = 4 << 20;  // of a request; in [64 KiB, 64 MiB]
  // Memory that the calls of all clients hold, beside that of one client (client.max_bytes): both
  // in [max_message_bytes, 1 TiB].
  std::size_t max_call_bytes = std::size_t{160} << 20;
  // A stream's reader that falls so far behind ReaderPace::kLeastBytesPerSecond loses the stream.
  absl::Duration slow_reader_timeout = absl::Seconds(30);
  // A stream of requests that brings nothing for so long ends.
  absl::Duration slow_sender_timeout = absl::Seconds(60);
  // How long Shutdown() lets calls end by themselves.
  absl::Duration drain_timeout = absl::Seconds(5);

  // INVALID_ARGUMENT naming every field out of range.
  absl::Status Validate() const;
};

// Whether what is offered at options.listen and web_listen is safe to offer there:
// FAILED_PRECONDITION for an address beyond loopback without TLS or without tokens (or client
// certificates), unless `insecure`; INVALID_ARGUMENT for bad options.
absl::Status CheckExposure(const ServerOptions& options);

// Serves from Start() to Shutdown(): strata.v1, grpc.health.v1 (for anybody) and reflection (for
// whoever is known; not in plain text with tokens). Thread-safe. Health of the server as a whole
// ("") and of "liveness" is SERVING as long as it lives; that of each strata.v1 service only while
// nothing keeps it from its work (readiness.h).
class Server {
 public:
  // `database` must outlive the server, and so must what `checks` look at: causes not to be ready
  // beside the server's own (disk, maps, commits, listener). What CheckExposure, CheckTls and
  // ReadTokenFile answer; UNAVAILABLE if the address cannot be listened on.
  static absl::StatusOr<std::unique_ptr<Server>> Start(api::Database& database,
                                                       const ServerOptions& options,
                                                       std::vector<ReadinessCheck> checks = {});
  virtual ~Server() = default;  // shuts down

  // HOST:PORT with the true port.
  virtual const std::string& address() const = 0;
  // http://HOST:PORT, or https, of web_listen; empty without it.
  virtual std::string web_url() const = 0;
  // Health says NOT_SERVING, new calls are refused, those under way end or are cancelled after
  // drain_timeout. Returns when all have ended. Again: nothing.
  virtual void Shutdown() = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVER_H_
