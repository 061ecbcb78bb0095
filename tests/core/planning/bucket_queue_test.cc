#include "core/planning/bucket_queue.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace strata {
namespace {

// What the queue promises, with a map from bucket to values.
class Model {
 public:
  explicit Model(int shift) : shift_(shift) {}
  void Push(std::uint32_t priority, std::uint32_t value) {
    std::uint32_t bucket = priority >> shift_;
    if (begun_) bucket = std::max(bucket, current_);
    if (!begun_) current_ = bucket;
    begun_ = true;
    buckets_[bucket].push_back(value);
  }
  std::uint32_t Pop() {
    const auto lowest = buckets_.begin();
    current_ = lowest->first;
    const std::uint32_t value = lowest->second.front();
    lowest->second.pop_front();
    if (lowest->second.empty()) buckets_.erase(lowest);
    return value;
  }
  void KeepEven() {
    for (auto it = buckets_.begin(); it != buckets_.end();) {
      std::erase_if(it->second, [](std::uint32_t value) { return value % 2 != 0; });
      it = it->second.empty() ? buckets_.erase(it) : std::next(it);
    }
  }
  bool empty() const { return buckets_.empty(); }
  std::size_t size() const {
    std::size_t size = 0;
    for (const auto& [bucket, values] : buckets_) size += values.size();
    return size;
  }
  std::uint32_t lower_bound() const { return current_ << shift_; }

 private:
  const int shift_;
  bool begun_ = false;
  std::uint32_t current_ = 0;
  std::map<std::uint32_t, std::deque<std::uint32_t>> buckets_;
};

TEST(BucketQueueTest, GivesBackInTheOrderOfBucketsHoweverFarTheySpan) {
  const std::uint64_t seed = 20261123;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  BucketQueue queue;
  for (int round = 0; round < 60; ++round) {
    const int shift = static_cast<int>(random() % 7);
    const std::uint32_t span = 1U << (4 + random() % 26);  // up to 64 times what the ring holds
    queue.Clear(shift);
    Model model(shift);
    for (std::uint32_t step = 0; step < 4000; ++step) {
      if (random() % 500 == 0) {
        queue.Keep([](std::uint32_t value) { return value % 2 == 0; });
        model.KeepEven();
      }
      if (model.empty() || random() % 100 < (step < 2500 ? 60 : 30)) {
        const std::uint32_t priority = model.lower_bound() + random() % span;
        if (priority >= 0xF0000000U) continue;
        queue.Push(priority, step);
        model.Push(priority, step);
      } else {
        ASSERT_EQ(queue.Pop(), model.Pop()) << "round " << round << ", step " << step;
        ASSERT_EQ(queue.lower_bound(), model.lower_bound());
      }
      ASSERT_EQ(queue.empty(), model.empty());
      ASSERT_EQ(queue.size(), model.size());
    }
  }
}

}  // namespace
}  // namespace strata
