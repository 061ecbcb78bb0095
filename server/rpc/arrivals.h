// Calls that have come in and have not gone.
#ifndef STRATA_SERVER_RPC_ARRIVALS_H_
#define STRATA_SERVER_RPC_ARRIVALS_H_

#include <deque>
#include <functional>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "server/rpc/refusals.h"

namespace strata::server {

// Counts calls by client from where gRPC takes them in to where they are freed. In between a call
// is some 24 KB, whether its handler has run or not, and also when the client reset it long before:
// begun and reset as fast as the wire is, they are gigabytes. Thread-safe.
class Arrivals {
 public:
  // `most`: of one client.
  explicit Arrivals(int most) : most_(most) {}

  // In: Begin() follows when the handler runs, and never for a call that is cancelled before. Else
  // the client has all it may have, and the call must be refused there and then. Of such a client a
  // hundred calls a second are let in all the same.
  Arrival Enter(absl::string_view client, int lane, absl::Time now);
  // Leave() must follow.
  void Begin(absl::string_view client, absl::Time now);
  void Leave(absl::string_view client);

 private:
  struct Client {
    std::deque<absl::Time> waiting;  // when calls came in whose handlers have not begun
    int running = 0;
    absl::Time let_in;  // when a call was, last
    Refusals refusals;
  };

  const int most_;
  absl::Mutex mutex_;
  std::map<std::string, Client, std::less<>> clients_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_ARRIVALS_H_
