// The sockets under gRPC.
#ifndef STRATA_SERVER_RPC_CONNECTIONS_H_
#define STRATA_SERVER_RPC_CONNECTIONS_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <sys/socket.h>

namespace strata::server {

// Who asks for a call is all that gRPC says before its handler runs, and not by which connection.
// So connections come in by lanes, each with a door of its own. Thread-safe.
class Connections {
 public:
  explicit Connections(int lanes) : lanes_(static_cast<std::size_t>(lanes)) {}

  // Takes note of a connection that was accepted; the socket is gRPC's to close. Returns its lane,
  // 0 <= lane < lanes, in turn. nullopt: not now, since connections of this host were cut within
  // the last second.
  std::optional<int> Add(int socket, absl::Time now);
  // Ends the connections of a lane: what has come in by them and was not read yet is gone, too, and
  // gRPC finds them broken.
  void Cut(int lane, absl::Time now);
  // So many until now.
  std::uint64_t cut() const;

 private:
  struct Connection {
    int socket = -1;
    sockaddr_storage peer = {};
  };
  struct Lane {
    std::vector<Connection> connections;
    std::size_t sweep_at = 1;
  };

  // Forgets those that were closed.
  static void Sweep(Lane& lane);

  bool WasCut(const std::string& host, absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  mutable absl::Mutex mutex_;
  std::vector<Lane> lanes_ ABSL_GUARDED_BY(mutex_);
  std::size_t next_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, absl::Time> hosts_cut_ ABSL_GUARDED_BY(mutex_);  // lately
  std::uint64_t cut_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Time logged_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_CONNECTIONS_H_
