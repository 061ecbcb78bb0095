// How long a command stays with a server that is away.
#ifndef STRATA_CLIENT_CLI_TERMINAL_PATIENCE_H_
#define STRATA_CLIENT_CLI_TERMINAL_PATIENCE_H_

#include <algorithm>

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "core/common/steady_time.h"

namespace strata::cli {

// How long a command puts up with a server that is away or busy.
inline constexpr absl::Duration kPatience = absl::Minutes(1);

// Counts from the first of several failures in a row. Not thread-safe.
class Patience {
 public:
  // True if it is worth asking again after `status`: always after OK, for kPatience while the
  // server is UNAVAILABLE, never after another error.
  bool Has(const absl::Status& status) {
    if (!absl::IsUnavailable(status)) {
      away_since_ = absl::InfiniteFuture();
      return status.ok();
    }
    away_since_ = std::min(away_since_, SteadyNow());
    return SteadyNow() - away_since_ < kPatience;
  }

 private:
  absl::Time away_since_ = absl::InfiniteFuture();
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_PATIENCE_H_
