// How much one client may have under way, and how often it may ask.
#ifndef STRATA_SERVER_RPC_CLIENT_LIMITS_H_
#define STRATA_SERVER_RPC_CLIENT_LIMITS_H_

#include <cstddef>
#include <functional>
#include <map>
#include <string>

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
};

// Books by client: a principal, or an address where nobody is known. The rate is that of a token
// bucket. Thread-safe.
class ClientLimits {
 public:
  enum class Kind { kCall, kWatch };

  explicit ClientLimits(const ClientLimitOptions& options) : options_(options) {}

  // OK: the call has begun, and Leave() must follow. RESOURCE_EXHAUSTED, with the time to wait,
  // otherwise: nothing was booked.
  absl::Status Enter(absl::string_view client, Kind kind, absl::Time now);
  void Leave(absl::string_view client, Kind kind);

  // Clients in the books: those with calls under way and those that came lately.
  std::size_t clients() const;

 private:
  struct Client {
    int calls = 0;
    int watches = 0;
    double allowance = 0.0;  // calls that may begin at `counted`
    absl::Time counted;
  };

  bool Idle(const Client& client, absl::Time now) const;
  void ForgetIdle(absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes one from the allowance, or says how long until there is one.
  absl::Duration TakeAllowance(Client& client, absl::Time now) const;

  const ClientLimitOptions options_;
  mutable absl::Mutex mutex_;
  std::map<std::string, Client, std::less<>> clients_ ABSL_GUARDED_BY(mutex_);
  std::size_t forget_at_ ABSL_GUARDED_BY(mutex_) = 1024;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_CLIENT_LIMITS_H_
