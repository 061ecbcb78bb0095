// When to try a call again.
#ifndef STRATA_CLIENT_SDK_BACKOFF_H_
#define STRATA_CLIENT_SDK_BACKOFF_H_

#include <algorithm>
#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "client/sdk/client.h"
#include "core/common/stop.h"

namespace strata::sdk {

// The attempts of one call. Not thread-safe.
class Backoff {
 public:
  // `uniform` draws from [0, 1).
  Backoff(const BackoffOptions& options, std::function<double()> uniform);
  // Draws from a generator seeded by chance. `servers`: that may have what one has not.
  explicit Backoff(const BackoffOptions& options, int servers = 1);

  // The pause before the next attempt after one that ended with `status`; nullopt if it is not to
  // be repeated: another error, or no attempts left. CANCELLED is: callers know whether they
  // cancelled.
  std::optional<absl::Duration> NextPause(const absl::Status& status);

  // The next attempt goes to a server that the one before has named: that there are several is
  // known now.
  void NoteServerNamed() { servers_ = std::max(servers_, 2); }

  // Sleeps the next pause. False if there is none, or `stop` comes first.
  bool Wait(const absl::Status& status, const Stop& stop);

 private:
  BackoffOptions options_;
  std::function<double()> uniform_;
  int servers_ = 1;
  int attempts_ = 1;
  int elsewhere_ = 0;                // servers in a row that had not the map
  std::optional<absl::Time> until_;  // attempts are not counted
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_BACKOFF_H_
