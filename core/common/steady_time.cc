#include "core/common/steady_time.h"

#include <chrono>

#include "absl/time/clock.h"

namespace strata {

absl::Time SteadyNow() {
  using Clock = std::chrono::steady_clock;
  static const Clock::time_point first = Clock::now();
  static const absl::Time begin = absl::Now();
  return begin + absl::FromChrono(Clock::now() - first);
}

}  // namespace strata
