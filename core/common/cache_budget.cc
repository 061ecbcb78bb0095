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
// With the half that may be reserved, all that caches have.
constexpr std::size_t kSmallShares = 12;
constexpr absl::Duration kLookInterval = absl::Milliseconds(50);  // at who waits no more

}  // namespace

std::size_t CacheBudget::cached_bytes() const {
  absl::MutexLock lock(&mutex_);
  return cached_;
}

bool CacheBudget::Fits(std::size_t bytes) const {
  return bytes <= max_bytes_ / 2 && reserved_ + bytes <= max_bytes_ / 2;
}

bool CacheBudget::Reserve(std::size_t bytes) {
  Values dropped;
  absl::MutexLock lock(&mutex_);
  if (!Fits(bytes)) return false;
  reserved_ += bytes;
  Trim();
  dropped.swap(dropped_);
  return true;
}

absl::Status CacheBudget::Await(const absl::Condition& condition, const Stop& stop) {
  while (!mutex_.AwaitWithTimeout(condition, kLookInterval)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  return absl::OkStatus();
}

absl::Status CacheBudget::AwaitReserve(std::size_t bytes, const Stop& stop) {
  if (bytes > max_bytes_ / 2) {
    return absl::ResourceExhaustedError(absl::StrCat(
        bytes, " bytes are more than half of the caches' ", max_bytes_, "; give them more"));
  }
  Values dropped;
  absl::MutexLock lock(&mutex_);
  const auto self = waiting_.insert(waiting_.end(), bytes);
  const auto is_next = [this, self]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return self == waiting_.begin() && Fits(*self);
  };
  const absl::Status status = Await(absl::Condition(&is_next), stop);
  waiting_.erase(self);
  STRATA_RETURN_IF_ERROR(status);
  reserved_ += bytes;
  Trim();
  dropped.swap(dropped_);
  return absl::OkStatus();
}

absl::Status CacheBudget::AwaitSmallShare(const Stop& stop) {
  Values dropped;
  absl::MutexLock lock(&mutex_);
  const auto is_left = [this]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return small_shares_ < kSmallShares;
  };
  STRATA_RETURN_IF_ERROR(Await(absl::Condition(&is_left), stop));
  ++small_shares_;
  Trim();
  dropped.swap(dropped_);
  return absl::OkStatus();
}

void CacheBudget::ReleaseSmallShare() {
  absl::MutexLock lock(&mutex_);
  --small_shares_;
}

void CacheBudget::Release(std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  reserved_ -= bytes;
}

void CacheBudget::Trim() {
  const std::size_t taken = reserved_ + small_shares_ * small_share();
  while (cached_ + taken > max_bytes_ - max_bytes_ / kHeapShare && !order_.empty()) {
    const std::function<void()> evict = std::move(order_.back().evict);
    evict();
  }
}

}  // namespace strata
