// How much memory all caches of a process may take together.
#ifndef STRATA_CORE_COMMON_CACHE_BUDGET_H_
#define STRATA_CORE_COMMON_CACHE_BUDGET_H_

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"

namespace strata {

// Where the caches that share it (LruCache) have filled seven eighths of it, the value that was
// used longest ago goes, whichever cache it is in: the rest is the heap's. Thread-safe; one mutex
// for all its caches.
class CacheBudget {
 public:
  explicit CacheBudget(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  CacheBudget(const CacheBudget&) = delete;
  CacheBudget& operator=(const CacheBudget&) = delete;

  std::size_t max_bytes() const { return max_bytes_; }
  // Held by caches now.
  std::size_t cached_bytes() const;

  // Takes memory for something that is no cache from what the caches may hold, until Release().
  // False, and nothing is taken, where all that is taken would be more than half of the budget.
  bool Reserve(std::size_t bytes);
  // The same once others have released enough, in the order of those who wait. RESOURCE_EXHAUSTED
  // for more than half of the budget, else as `stop` says.
  absl::Status AwaitReserve(std::size_t bytes, const Stop& stop);
  void Release(std::size_t bytes);

  // small_share() for work that has to begin at once: of three eighths of the budget that nothing
  // else is taken from, so that it never waits for what takes long. Errors are those of `stop`.
  absl::Status AwaitSmallShare(const Stop& stop);
  void ReleaseSmallShare();
  std::size_t small_share() const { return max_bytes_ / 32; }

 private:
  template <typename Key, typename Value>
  friend class LruCache;

  struct Item {
    std::size_t bytes;
    std::function<void()> evict;  // takes the value out of its cache, and this item out of order_
  };
  using Order = std::list<Item>;
  using Values = std::vector<std::shared_ptr<const void>>;

  bool Fits(std::size_t bytes) const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  // Returns with mutex_ held once `condition` holds, or as `stop` says.
  absl::Status Await(const absl::Condition& condition, const Stop& stop)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Evicts until all fits. What is evicted lies in dropped_, to be destroyed without the mutex.
  void Trim() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::size_t max_bytes_;
  mutable absl::Mutex mutex_;
  Order order_ ABSL_GUARDED_BY(mutex_);  // the latest used first
  std::size_t cached_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t reserved_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t small_shares_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<std::size_t> waiting_ ABSL_GUARDED_BY(mutex_);  // what is asked for, in order
  Values dropped_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_CACHE_BUDGET_H_
