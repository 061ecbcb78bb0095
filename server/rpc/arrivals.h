// Calls that have come in and have not gone.
#ifndef STRATA_SERVER_RPC_ARRIVALS_H_
#define STRATA_SERVER_RPC_ARRIVALS_H_

#include <functional>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace strata::server {

// Counts calls by client from where gRPC takes them in to where they are freed. In between a call
// is some 24 KB, whether its handler has run or not, and also when the client reset it long before:
// begun and reset as fast as the wire is, they are gigabytes. Thread-safe.
class Arrivals {
 public:
  // `most`: of one client.
  explicit Arrivals(int most) : most_(most) {}

  // False: the client has all it may have, and the call must be refused there and then. True:
  // Leave() must follow.
  bool Enter(absl::string_view client, absl::Time now);
  void Leave(absl::string_view client, absl::Time now);

 private:
  struct Client {
    int here = 0;
    absl::Time left;  // the last one, or when the first came
  };

  const int most_;
  absl::Mutex mutex_;
  std::map<std::string, Client, std::less<>> clients_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_ARRIVALS_H_
