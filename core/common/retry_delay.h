// How long a refused call is to wait before it is made again, said by its status.
#ifndef STRATA_CORE_COMMON_RETRY_DELAY_H_
#define STRATA_CORE_COMMON_RETRY_DELAY_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace strata {

// `status` with the delay attached (a payload, rounded up to milliseconds), over one it had; OK
// stays OK.
absl::Status WithRetryDelay(absl::Status status, absl::Duration delay);

// The attached delay, not negative; nullopt where the same call would fail again.
std::optional<absl::Duration> RetryDelayOf(const absl::Status& status);

}  // namespace strata

#endif  // STRATA_CORE_COMMON_RETRY_DELAY_H_
