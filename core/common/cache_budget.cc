#include "core/common/cache_budget.h"

#include <cstddef>
#include <functional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/stop.h"

namespace strata {
namespace {

// What the heap loses between blocks that come and go, and who still holds what has gone.
constexpr std::size_t kHeapShare = 8;
constexpr absl::Duration kLookInterval = absl::Milliseconds(50);  // at who waits no more

}  // namespace

std::size_t CacheBudget::cached_bytes() const {
  absl::MutexLock lock(&mutex_);
  return cached_;
}

bool CacheBudget::Fits(std::size_t bytes) const {
  return bytes <= max_bytes_ / 2 && reserved_ + bytes <= max_bytes_ / 2;
}

bool CacheBudget::TryReserve(std::size_t bytes) {
  if (!Fits(bytes)) return false;
  reserved_ += bytes;
  Trim();
  return true;
}

bool CacheBudget::Reserve(std::size_t bytes) {
  Values dropped;
  absl::MutexLock lock(&mutex_);
  if (!TryReserve(bytes)) return false;
  dropped.swap(dropped_);
  return true;
}

absl::Status CacheBudget::AwaitReserve(std::size_t bytes, const Stop& stop) {
  if (bytes > max_bytes_ / 2) {
    return absl::ResourceExhaustedError(absl::StrCat(
        bytes, " bytes are more than half of the caches' ", max_bytes_, "; give them more"));
  }
  Values dropped;
  absl::MutexLock lock(&mutex_);
  const auto has_room = [this, bytes]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return Fits(bytes); };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&has_room), kLookInterval)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  TryReserve(bytes);
  dropped.swap(dropped_);
  return absl::OkStatus();
}

void CacheBudget::Release(std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  reserved_ -= bytes;
}

void CacheBudget::Trim() {
  while (cached_ + reserved_ > max_bytes_ - max_bytes_ / kHeapShare && !order_.empty()) {
    const std::function<void()> evict = std::move(order_.back().evict);
    evict();
  }
}

}  // namespace strata
