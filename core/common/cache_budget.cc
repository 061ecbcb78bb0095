#include "core/common/cache_budget.h"

#include <cstddef>
#include <functional>
#include <utility>

namespace strata {

std::size_t CacheBudget::cached_bytes() const {
  absl::MutexLock lock(&mutex_);
  return cached_;
}

bool CacheBudget::Reserve(std::size_t bytes) {
  Values dropped;
  absl::MutexLock lock(&mutex_);
  if (bytes > max_bytes_ / 2 || reserved_ + bytes > max_bytes_ / 2) return false;
  reserved_ += bytes;
  Trim();
  dropped.swap(dropped_);
  return true;
}

void CacheBudget::Release(std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  reserved_ -= bytes;
}

void CacheBudget::Trim() {
  while (cached_ + reserved_ > max_bytes_ && !order_.empty()) {
    const std::function<void()> evict = std::move(order_.back().evict);
    evict();
  }
}

}  // namespace strata
