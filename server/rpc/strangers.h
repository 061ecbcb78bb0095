// Callers that nobody knows.
#ifndef STRATA_SERVER_RPC_STRANGERS_H_
#define STRATA_SERVER_RPC_STRANGERS_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "server/rpc/client_limits.h"
#include "server/rpc/refusals.h"

namespace strata::server {

struct StrangerOptions {
  double calls_per_second = 10.0;  // of one address, in the long run
  double burst = 1000.0;           // at once after a pause
  double all_per_second = 100.0;   // of all addresses
  double all_burst = 10'000.0;
  // Over all addresses: whose requests are read before they are refused, and logged.
  double heard_per_second = 8.0;
  double heard_burst = 8.0;
  std::size_t heard_at_once = 4;  // each may send as much as the largest request
};

// How often who is not known may ask and be told why, and how much of that is logged. Whoever shows
// a token that is known is not concerned, also at the same address. Thread-safe.
class Strangers {
 public:
  explicit Strangers(const StrangerOptions& options);

  // OK: a stranger from `address` is told why he is refused. RESOURCE_EXHAUSTED with the time to
  // wait: there were too many lately.
  absl::Status Enter(absl::string_view address, absl::Time now);
  // In: he is heard, and Leave() follows, but never for a call that is cancelled before its handler
  // runs. Else the door refuses him by a word, and nothing else is done about him.
  Arrival Hear(int lane, absl::Time now);
  // One who was heard is gone, and what he sent.
  void Leave();
  // At most once a second: how many were refused since the last time, this one included. nullopt:
  // this one needs no line in the log.
  std::optional<std::uint64_t> ToLog(absl::Time now);

 private:
  ClientLimits all_;
  ClientLimits by_address_;
  ClientLimits heard_;
  const std::size_t heard_at_once_;
  absl::Mutex mutex_;
  std::deque<absl::Time> hearing_ ABSL_GUARDED_BY(mutex_);  // since when
  Refusals refusals_ ABSL_GUARDED_BY(mutex_);
  absl::Time logged_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  std::uint64_t not_logged_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_STRANGERS_H_
