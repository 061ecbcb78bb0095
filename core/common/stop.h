// How long work learns that nobody waits for it any more.
#ifndef STRATA_CORE_COMMON_STOP_H_
#define STRATA_CORE_COMMON_STOP_H_

#include <atomic>
#include <memory>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace strata {

// A deadline and a cancellation flag. Copies share the flag; any thread may request or ask. Long
// loops call `status()` every few thousand steps (it reads the clock) and return it when it is not
// OK.
class Stop {
 public:
  // Never stops by time (that of SteadyNow()); stops when Request() is called on it or on a copy.
  Stop() : Stop(absl::InfiniteFuture()) {}
  explicit Stop(absl::Time deadline)
      : deadline_(deadline), requested_(std::make_shared<std::atomic<bool>>(false)) {}

  // Asks the work to end; it answers CANCELLED.
  void Request() const { requested_->store(true, std::memory_order_relaxed); }
  bool requested() const { return requested_->load(std::memory_order_relaxed); }
  absl::Time deadline() const { return deadline_; }

  // OK, CANCELLED or DEADLINE_EXCEEDED.
  absl::Status status() const;

 private:
  absl::Time deadline_;
  std::shared_ptr<std::atomic<bool>> requested_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_STOP_H_
