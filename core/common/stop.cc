#include "core/common/stop.h"

#include "absl/status/status.h"
#include "absl/time/time.h"

#include "core/common/steady_time.h"

namespace strata {

absl::Status Stop::status() const {
  if (requested()) return absl::CancelledError("cancelled by the caller");
  if (deadline_ != absl::InfiniteFuture() && SteadyNow() >= deadline_) {
    return absl::DeadlineExceededError("deadline passed before the work was done");
  }
  return absl::OkStatus();
}

}  // namespace strata
