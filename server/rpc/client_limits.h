// How much one client may have under way, how much memory that may hold, and how often it may ask.
#ifndef STRATA_SERVER_RPC_CLIENT_LIMITS_H_
#define STRATA_SERVER_RPC_CLIENT_LIMITS_H_

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace strata::server {

struct ClientLimitOptions {
  int max_calls = 256;     // under way, streams included
  int max_watches = 2048;  // under way
  // Calls begun a second, in the long run; 0: any number.
  double calls_per_second = 0.0;
  // Calls that may come at once after a pause; at least 1.
  double burst = 100.0;
  // Memory that its calls hold at a time: requests as parsed, what of a stream is kept, answers
  // that it has not taken.
  std::size_t max_bytes = std::size_t{64} << 20;
};

// Books by client: a principal, or an address where nobody is known. The rate is that of a token
// bucket. Thread-safe.
class ClientLimits {
 public:
  enum class Kind { kCall, kWatch };

  // `max_bytes`: of memory that the calls of all clients hold.
  ClientLimits(const ClientLimitOptions& options, std::size_t max_bytes)
      : options_(options), max_bytes_(max_bytes) {}

  // OK: the call has begun, and Leave() must follow. RESOURCE_EXHAUSTED, with the time to wait,
  // otherwise: nothing was booked.
  absl::Status Enter(absl::string_view client, Kind kind, absl::Time now);
  void Leave(absl::string_view client, Kind kind);
  // Books `more` memory for a call of `client` that has begun, which needs `all` with what is
  // booked for the same purpose already; Release() must follow. RESOURCE_EXHAUSTED, with the time
  // to wait unless `all` is more than the client may ever hold: nothing was booked.
  absl::Status Hold(absl::string_view client, std::size_t more, std::size_t all);
  void Release(absl::string_view client, std::size_t bytes);

  // Clients in the books: those with calls under way and those that came lately.
  std::size_t clients() const;
  // Memory that is booked.
  std::size_t held_bytes() const;

 private:
  struct Client {
    int calls = 0;
    int watches = 0;
    std::size_t bytes = 0;
    double allowance = 0.0;  // calls that may begin at `counted`
    absl::Time counted;
  };

  bool Idle(const Client& client, absl::Time now) const;
  void ForgetIdle(absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes one from the allowance, or says how long until there is one.
  absl::Duration TakeAllowance(Client& client, absl::Time now) const;

  const ClientLimitOptions options_;
  const std::size_t max_bytes_;
  mutable absl::Mutex mutex_;
  std::size_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, Client, std::less<>> clients_ ABSL_GUARDED_BY(mutex_);
  std::size_t forget_at_ ABSL_GUARDED_BY(mutex_) = 1024;
};

// Memory booked for one purpose of a call; gone with this. Not thread-safe.
class Booking {
 public:
  // `client` must have a call under way in `limits`, which must outlive this.
  Booking(ClientLimits& limits, std::string client)
      : limits_(&limits), client_(std::move(client)) {}
  ~Booking() { Release(); }
  Booking(Booking&& other) noexcept
      : limits_(other.limits_), client_(other.client_), bytes_(std::exchange(other.bytes_, 0)) {}
  Booking& operator=(Booking&& other) noexcept {
    Release();
    limits_ = other.limits_;
    client_ = other.client_;
    bytes_ = std::exchange(other.bytes_, 0);
    return *this;
  }

  // What it holds from now on; ClientLimits::Hold's errors, where it holds what it did before.
  absl::Status Resize(std::size_t bytes);
  void Release() { Resize(0).IgnoreError(); }
  std::size_t bytes() const { return bytes_; }

 private:
  ClientLimits* limits_;
  std::string client_;
  std::size_t bytes_ = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_CLIENT_LIMITS_H_
