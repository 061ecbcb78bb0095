// Values that were made at some cost, kept up to a number of bytes, the least recently used going
// first.
#ifndef STRATA_CORE_ENGINE_LRU_CACHE_H_
#define STRATA_CORE_ENGINE_LRU_CACHE_H_

#include <cstddef>
#include <list>
#include <memory>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace strata {

// Not thread-safe; the values are shared and immutable.
template <typename Key, typename Value>
class LruCache {
 public:
  using Handle = std::shared_ptr<const Value>;

  explicit LruCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // nullptr if it is not there.
  Handle Find(const Key& key) {
    const auto it = index_.find(key);
    if (it == index_.end()) return nullptr;
    order_.splice(order_.begin(), order_, it->second);
    return it->second->value;
  }

  // Replaces what was there. A value larger than the cache is not kept.
  void Put(const Key& key, Handle value, std::size_t bytes) {
    Erase(key);
    if (bytes > max_bytes_) return;
    order_.push_front({key, std::move(value), bytes});
    index_[key] = order_.begin();
    bytes_ += bytes;
    while (bytes_ > max_bytes_) EraseAt(std::prev(order_.end()));
  }

  void Erase(const Key& key) {
    const auto it = index_.find(key);
    if (it != index_.end()) EraseAt(it->second);
  }

  void Clear() {
    index_.clear();
    order_.clear();
    bytes_ = 0;
  }

  std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    Key key;
    Handle value;
    std::size_t bytes;
  };
  using Order = std::list<Entry>;

  void EraseAt(typename Order::iterator it) {
    bytes_ -= it->bytes;
    index_.erase(it->key);
    order_.erase(it);
  }

  const std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  Order order_;
  absl::flat_hash_map<Key, typename Order::iterator> index_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LRU_CACHE_H_
