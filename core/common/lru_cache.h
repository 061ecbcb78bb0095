// Values that were made at some cost, kept as long as they fit a budget that caches share.
#ifndef STRATA_CORE_COMMON_LRU_CACHE_H_
#define STRATA_CORE_COMMON_LRU_CACHE_H_

#include <cstddef>
#include <iterator>
#include <list>
#include <memory>
#include <new>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

#include "core/common/cache_budget.h"
#include "core/common/hash_map.h"

namespace strata {

// Thread-safe; the values are shared, and immutable if `Value` is const.
template <typename Key, typename Value>
class LruCache {
 public:
  using Handle = std::shared_ptr<Value>;

  // Holds at most `max_bytes` of the budget.
  LruCache(std::shared_ptr<CacheBudget> budget, std::size_t max_bytes)
      : budget_(std::move(budget)), max_bytes_(max_bytes) {}
  explicit LruCache(const std::shared_ptr<CacheBudget>& budget)
      : LruCache(budget, budget->max_bytes()) {}
  ~LruCache() { Clear(); }
  LruCache(const LruCache&) = delete;
  LruCache& operator=(const LruCache&) = delete;

  // nullptr if it is not there.
  Handle Find(const Key& key) {
    absl::MutexLock lock(&budget_->mutex_);
    const auto found = index_.find(key);
    if (found == index_.end()) return nullptr;
    const auto it = found->second;
    order_.splice(order_.begin(), order_, it);
    budget_->order_.splice(budget_->order_.begin(), budget_->order_, it->item);
    return it->value;
  }

  // Replaces what was there. A value larger than the cache may be is not kept.
  void Put(const Key& key, Handle value, std::size_t bytes) {
    CacheBudget::Values dropped;
    absl::MutexLock lock(&budget_->mutex_);
    EraseKey(key);
    if (bytes <= max_bytes_) {
      Insert(key, std::move(value), bytes);
      while (bytes_ > max_bytes_) EraseAt(std::prev(order_.end()));
      budget_->Trim();
    }
    dropped.swap(budget_->dropped_);
  }

  void Erase(const Key& key) {
    CacheBudget::Values dropped;
    absl::MutexLock lock(&budget_->mutex_);
    EraseKey(key);
    dropped.swap(budget_->dropped_);
  }

  void Clear() {
    CacheBudget::Values dropped;
    absl::MutexLock lock(&budget_->mutex_);
    while (!order_.empty()) EraseAt(order_.begin());
    dropped.swap(budget_->dropped_);
  }

  std::size_t bytes() const {
    absl::MutexLock lock(&budget_->mutex_);
    return bytes_;
  }

 private:
  struct Entry {
    Key key;
    Handle value;
    CacheBudget::Order::iterator item;
  };
  using Order = std::list<Entry>;

  void Insert(const Key& key, Handle value, std::size_t bytes)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(budget_->mutex_) {
    // What may fail for want of memory comes first, so that a failure changes nothing.
    Order entry;
    entry.push_front({key, std::move(value), {}});
    const auto it = entry.begin();
    // Called with the mutex, which is the budget's own.
    const auto evict = [this, it]() ABSL_NO_THREAD_SAFETY_ANALYSIS { EraseAt(it); };
    CacheBudget::Order item;
    item.push_front({bytes, evict});
    index_.emplace(key, it);
    order_.splice(order_.begin(), entry);
    budget_->order_.splice(budget_->order_.begin(), item);
    it->item = budget_->order_.begin();
    bytes_ += bytes;
    budget_->cached_ += bytes;
  }

  void EraseKey(const Key& key) ABSL_EXCLUSIVE_LOCKS_REQUIRED(budget_->mutex_) {
    const auto found = index_.find(key);
    if (found != index_.end()) EraseAt(found->second);
  }

  void EraseAt(typename Order::iterator it) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(budget_->mutex_) {
    bytes_ -= it->item->bytes;
    budget_->cached_ -= it->item->bytes;
    try {
      budget_->dropped_.push_back(std::move(it->value));
    } catch (const std::bad_alloc&) {
      it->value = nullptr;  // goes with the mutex held, then
    }
    index_.erase(it->key);
    budget_->order_.erase(it->item);
    order_.erase(it);
  }

  const std::shared_ptr<CacheBudget> budget_;
  const std::size_t max_bytes_;
  std::size_t bytes_ ABSL_GUARDED_BY(budget_->mutex_) = 0;
  Order order_ ABSL_GUARDED_BY(budget_->mutex_);  // the latest used first
  HashMap<Key, typename Order::iterator> index_ ABSL_GUARDED_BY(budget_->mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_LRU_CACHE_H_
