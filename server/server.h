// The gRPC server around a database.
#ifndef STRATA_SERVER_SERVER_H_
#define STRATA_SERVER_SERVER_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/api/database.h"

namespace strata::server {

struct ServerOptions {
  std::string listen = "127.0.0.1:50051";  // HOST:PORT; port 0: any free one
  // Listen beyond loopback although nothing is encrypted and nobody is asked who he is.
  bool insecure = false;
  int query_threads = 8;    // calls answered at a time; in [1, 1000]
  int stream_threads = 8;   // listings and downloads served at a time; in [1, 1000]
  int upload_threads = 16;  // scans taken in at a time; in [1, 1000]
  // Calls under way, streams included but watches of maps and jobs, which cost little and have a
  // limit of their own; more are told to come back. In [1, 1'000'000].
  int max_calls = 1024;
  int max_watches = 4096;
  // A stream's reader that takes nothing for so long loses the stream.
  absl::Duration slow_reader_timeout = absl::Seconds(30);
  // How long Shutdown() lets calls end by themselves.
  absl::Duration drain_timeout = absl::Seconds(5);

  // INVALID_ARGUMENT naming every field out of range.
  absl::Status Validate() const;
};

// Serves from Start() to Shutdown(): strata.v1, grpc.health.v1 (by server and by service) and
// reflection. Requests above 4 MiB are refused. Thread-safe.
class Server {
 public:
  // `database` must outlive the server. INVALID_ARGUMENT for bad options; FAILED_PRECONDITION for
  // an address beyond loopback without `insecure`; UNAVAILABLE if it cannot be listened on.
  static absl::StatusOr<std::unique_ptr<Server>> Start(api::Database& database,
                                                       const ServerOptions& options);
  virtual ~Server() = default;  // shuts down

  // HOST:PORT with the true port.
  virtual const std::string& address() const = 0;
  // Health says NOT_SERVING, new calls are refused, those under way end or are cancelled after
  // drain_timeout. Returns when all have ended. Again: nothing.
  virtual void Shutdown() = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVER_H_
