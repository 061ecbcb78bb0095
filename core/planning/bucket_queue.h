// A priority queue of patches for whole-number priorities that grow slowly.
#ifndef STRATA_CORE_PLANNING_BUCKET_QUEUE_H_
#define STRATA_CORE_PLANNING_BUCKET_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace strata {

// Buckets of 2^shift priorities in a ring that grows to the span in use; first in, first out within
// a bucket. The caller copes with the order inside a bucket by expanding again what got cheaper.
class BucketQueue {
 public:
  BucketQueue() : ring_(kFirstBuckets) {}

  // Starts anew with buckets of 2^shift.
  void Clear(int shift) {
    shift_ = shift;
    if (ring_.size() > kKeptBuckets) ring_ = std::vector<std::vector<std::uint32_t>>(kFirstBuckets);
    for (std::vector<std::uint32_t>& bucket : ring_) bucket.clear();
    size_ = 0;
    next_ = 0;
    begun_ = false;
  }
  bool empty() const { return size_ == 0; }
  // No queued priority is lower.
  std::uint32_t lower_bound() const { return current_ << shift_; }

  // A priority below lower_bound() counts as lower_bound(). The first one after Clear() sets it.
  void Push(std::uint32_t priority, std::uint32_t value) {
    std::uint32_t bucket = priority >> shift_;
    if (!begun_) current_ = bucket;
    begun_ = true;
    if (bucket < current_) bucket = current_;
    if (bucket - current_ >= ring_.size()) Grow(bucket);
    ring_[bucket & (ring_.size() - 1)].push_back(value);
    ++size_;
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
      bucket = &ring_[++current_ & (ring_.size() - 1)];
    }
    --size_;
    return (*bucket)[next_++];
  }

 private:
  static constexpr std::size_t kFirstBuckets = 1024;
  // A longer ring gives back the memory of buckets that are empty.
  static constexpr std::size_t kKeptBuckets = 4096;

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
  std::size_t size_ = 0;
  std::vector<std::vector<std::uint32_t>> ring_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_BUCKET_QUEUE_H_
