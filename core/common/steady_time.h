// Time for deadlines, pauses and ages: it goes on evenly whatever becomes of the machine's clock.
#ifndef STRATA_CORE_COMMON_STEADY_TIME_H_
#define STRATA_CORE_COMMON_STEADY_TIME_H_

#include "absl/time/time.h"

namespace strata {

// absl::Now() of the first call in this process, and what has passed since by the monotonic clock.
// Comparable within one process only. Thread-safe.
absl::Time SteadyNow();

}  // namespace strata

#endif  // STRATA_CORE_COMMON_STEADY_TIME_H_
