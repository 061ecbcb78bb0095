// Where connections come in.
#ifndef STRATA_SERVER_RPC_LISTENER_H_
#define STRATA_SERVER_RPC_LISTENER_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/common/host_port.h"

namespace strata::server {

// Accepts connections itself: gRPC 1.51 never accepts again after the process ran out of files
// once. A quarter of the files that the process may have stays for maps and their readers: what
// comes beyond that is closed at once. Thread-safe.
class Listener {
 public:
  // Takes over the descriptor, or returns false to be offered it again a moment later. Must not
  // block.
  using Take = std::function<bool(int fd)>;

  // Connections wait in the system until Accept(). All addresses that the host's name has.
  // NOT_FOUND for a name that has none; UNAVAILABLE if none can be listened on.
  static absl::StatusOr<std::unique_ptr<Listener>> Open(const HostPort& address);
  ~Listener() { Close(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // The true one.
  int port() const { return port_; }
  // Once.
  void Accept(Take take);
  // Nobody connects from now on. Safe to call again.
  void Close();

  // Connections that were closed at once, because the files ran short.
  std::uint64_t refused() const { return refused_; }
  // How long ago that happened last; infinite: never.
  absl::Duration since_refused() const;

 private:
  Listener() = default;
  void Loop();
  // Takes what waits at one of the sockets. False: the system has nothing left to take it with.
  bool AcceptAll(int socket);
  void Refuse(int fd);
  // Those that were not taken yet.
  void OfferHeld();

  int port_ = 0;
  int most_fd_ = 0;  // a connection with a higher number is refused
  int wake_ = -1;    // an eventfd that ends the loop
  std::vector<int> sockets_;
  Take take_;
  std::vector<int> held_;
  absl::Time offered_ = absl::InfinitePast();
  std::atomic<std::uint64_t> refused_ = 0;
  std::atomic<std::int64_t> refused_at_ms_ = -1;  // of SteadyNow()
  std::thread thread_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_LISTENER_H_
