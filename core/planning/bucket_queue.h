// A priority queue of patches for whole-number priorities that grow slowly.
#ifndef STRATA_CORE_PLANNING_BUCKET_QUEUE_H_
#define STRATA_CORE_PLANNING_BUCKET_QUEUE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace strata {

// Buckets of 2^shift priorities in a ring that grows to the span in use, up to kMostBuckets; what
// lies beyond waits in one list until the ring is empty. First in, first out within a bucket. The
// caller copes with the order inside a bucket by expanding again what got cheaper.
class BucketQueue {
 public:
  BucketQueue() : ring_(kFirstBuckets) {}

  // Starts anew with buckets of 2^shift.
  void Clear(int shift) {
    shift_ = shift;
    if (ring_.size() > kKeptBuckets) ring_ = std::vector<std::vector<std::uint32_t>>(kFirstBuckets);
    for (std::vector<std::uint32_t>& bucket : ring_) bucket.clear();
    beyond_ = {};
    in_ring_ = 0;
    next_ = 0;
    begun_ = false;
  }
  bool empty() const { return in_ring_ == 0 && beyond_.empty(); }
  std::size_t size() const { return in_ring_ + beyond_.size(); }
  // No queued priority is lower.
  std::uint32_t lower_bound() const { return current_ << shift_; }

  // A priority below lower_bound() counts as lower_bound(). The first one after Clear() sets it.
  void Push(std::uint32_t priority, std::uint32_t value) {
    std::uint32_t bucket = priority >> shift_;
    if (!begun_) Begin(bucket);
    begun_ = true;
    if (bucket < current_) bucket = current_;
    if (bucket < horizon_) {
      Put(bucket, value);
    } else {
      beyond_.emplace_back(bucket, value);
    }
  }
  // REQUIRES: !empty().
  std::uint32_t Pop() {
    std::vector<std::uint32_t>* bucket = &ring_[current_ & (ring_.size() - 1)];
    while (next_ == bucket->size()) {
      if (ring_.size() > kKeptBuckets) {
        *bucket = {};
      } else {
        bucket->clear();
      }
      next_ = 0;
      ++current_;
      if (in_ring_ == 0) TakeNext();
      bucket = &ring_[current_ & (ring_.size() - 1)];
    }
    --in_ring_;
    return (*bucket)[next_++];
  }
  // Forgets the values that are not `wanted`, with most of their memory. Others stay in order.
  template <typename Wanted>
  void Keep(const Wanted& wanted) {
    std::vector<std::uint32_t>& begun = ring_[current_ & (ring_.size() - 1)];
    begun.erase(begun.begin(), begun.begin() + static_cast<std::ptrdiff_t>(next_));
    next_ = 0;
    in_ring_ = 0;
    for (std::vector<std::uint32_t>& bucket : ring_) {
      std::erase_if(bucket, [&](std::uint32_t value) { return !wanted(value); });
      if (bucket.capacity() > 2 * bucket.size()) bucket.shrink_to_fit();
      in_ring_ += bucket.size();
    }
    std::erase_if(beyond_, [&](const auto& item) { return !wanted(item.second); });
    beyond_.shrink_to_fit();
  }

 private:
  static constexpr std::size_t kFirstBuckets = 1024;
  // A longer ring gives back the memory of buckets that are empty.
  static constexpr std::size_t kKeptBuckets = 4096;
  // 1.5 MB; a ring for all that a search of many kilometres spans would take hundreds.
  static constexpr std::uint32_t kMostBuckets = 65536;

  void Begin(std::uint32_t bucket) {
    current_ = bucket;
    horizon_ = bucket + kMostBuckets;
  }

  void Put(std::uint32_t bucket, std::uint32_t value) {
    if (bucket - current_ >= ring_.size()) Grow(bucket);
    ring_[bucket & (ring_.size() - 1)].push_back(value);
    ++in_ring_;
  }

  // Goes on with the lowest of what lies beyond, in the order in which it came.
  void TakeNext() {
    const auto lower = [](const auto& a, const auto& b) { return a.first < b.first; };
    Begin(std::min_element(beyond_.begin(), beyond_.end(), lower)->first);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> still;
    for (const auto& [bucket, value] : beyond_) {
      if (bucket < horizon_) {
        Put(bucket, value);
      } else {
        still.emplace_back(bucket, value);
      }
    }
    beyond_ = std::move(still);
  }

  void Grow(std::uint32_t bucket) {
    std::size_t size = ring_.size();
    while (bucket - current_ >= size) size *= 2;
    std::vector<std::vector<std::uint32_t>> ring(size);
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const auto b = static_cast<std::uint32_t>(current_ + i);
      ring[b & (size - 1)] = std::move(ring_[b & (ring_.size() - 1)]);
    }
    ring_ = std::move(ring);
  }

  int shift_ = 0;
  bool begun_ = false;
  std::uint32_t current_ = 0;  // the bucket that values are popped from,
  std::size_t next_ = 0;       // and where in it the next one is
  std::uint32_t horizon_ = 0;  // the ring is for buckets below
  std::size_t in_ring_ = 0;
  std::vector<std::vector<std::uint32_t>> ring_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> beyond_;  // bucket, value
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_BUCKET_QUEUE_H_
