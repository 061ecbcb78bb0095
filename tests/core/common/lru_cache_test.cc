#include "core/common/lru_cache.h"

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "tests/support/patience.h"

namespace strata {
namespace {

std::shared_ptr<const std::string> Text(const std::string& text) {
  return std::make_shared<const std::string>(text);
}

using Cache = LruCache<int, const std::string>;

TEST(LruCacheTest, WhatWasUsedLongestAgoGoesWhicheverCacheItIsIn) {
  const auto budget = std::make_shared<CacheBudget>(100);
  Cache a(budget);
  Cache b(budget);
  a.Put(1, Text("a1"), 40);
  b.Put(1, Text("b1"), 40);
  EXPECT_NE(a.Find(1), nullptr);  // now b's is older
  b.Put(2, Text("b2"), 40);
  EXPECT_NE(a.Find(1), nullptr);
  EXPECT_EQ(b.Find(1), nullptr);
  EXPECT_EQ(*b.Find(2), "b2");
  EXPECT_EQ(budget->cached_bytes(), 80U);
  EXPECT_EQ(a.bytes(), 40U);
}

TEST(LruCacheTest, ReplacesErasesAndKeepsNothingTooLarge) {
  const auto budget = std::make_shared<CacheBudget>(100);
  {
    Cache cache(budget, 50);
    cache.Put(1, Text("x"), 10);
    cache.Put(1, Text("y"), 20);
    EXPECT_EQ(*cache.Find(1), "y");
    EXPECT_EQ(cache.bytes(), 20U);
    cache.Put(2, Text("z"), 40);  // beyond the cache's own bound
    EXPECT_EQ(cache.Find(1), nullptr);
    cache.Put(2, Text("large"), 60);
    EXPECT_EQ(cache.Find(2), nullptr);
    cache.Put(3, Text("w"), 30);
    cache.Erase(3);
    EXPECT_EQ(budget->cached_bytes(), 0U);
    cache.Put(4, Text("v"), 30);
  }
  EXPECT_EQ(budget->cached_bytes(), 0U);
}

TEST(LruCacheTest, WhatIsReservedIsTakenFromTheCachesUpToHalf) {
  const auto budget = std::make_shared<CacheBudget>(100);
  Cache cache(budget);
  cache.Put(1, Text("a"), 50);
  cache.Put(2, Text("b"), 30);
  EXPECT_TRUE(budget->Reserve(30));
  EXPECT_EQ(cache.Find(1), nullptr);
  EXPECT_NE(cache.Find(2), nullptr);
  EXPECT_FALSE(budget->Reserve(21));
  EXPECT_TRUE(budget->Reserve(20));
  budget->Release(50);
  EXPECT_TRUE(budget->Reserve(50));
}

TEST(LruCacheTest, AnEighthOfTheBudgetIsLeftToTheHeap) {
  const auto budget = std::make_shared<CacheBudget>(80);
  Cache cache(budget);
  for (int i = 0; i < 8; ++i) cache.Put(i, Text("value"), 10);
  EXPECT_EQ(cache.bytes(), 70U);
  EXPECT_EQ(cache.Find(0), nullptr);
}

TEST(LruCacheTest, WhoHoldsAValueKeepsIt) {
  const auto budget = std::make_shared<CacheBudget>(16);
  Cache cache(budget);
  cache.Put(1, Text("kept"), 10);
  const Cache::Handle held = cache.Find(1);
  cache.Put(2, Text("other"), 10);
  EXPECT_EQ(cache.Find(1), nullptr);
  EXPECT_EQ(*held, "kept");
}

TEST(LruCacheTest, ManyThreadsShareABudget) {
  const auto budget = std::make_shared<CacheBudget>(1000);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&budget, t] {
      Cache cache(budget);
      for (int i = 0; i < 2000; ++i) {
        cache.Put(i % 50, Text(std::to_string(t)), 30);
        const Cache::Handle found = cache.Find((i + 7) % 50);
        if (found != nullptr) {
          EXPECT_EQ(*found, std::to_string(t));
        }
      }
      EXPECT_LE(budget->cached_bytes(), 1000U);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget->cached_bytes(), 0U);
}

TEST(CacheBudgetTest, WhatIsAwaitedComesWhenOthersRelease) {
  CacheBudget budget(100);
  EXPECT_EQ(budget.AwaitReserve(51, Stop()).code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(budget.AwaitReserve(40, Stop()).ok());
  const Stop stop;
  stop.Request();
  EXPECT_EQ(budget.AwaitReserve(20, stop).code(), absl::StatusCode::kCancelled);
  absl::Status waited = absl::InternalError("not asked");
  {
    std::jthread waiter([&] { waited = budget.AwaitReserve(20, Stop()); });
    budget.Release(40);
  }
  EXPECT_TRUE(waited.ok()) << waited;
  EXPECT_TRUE(budget.Reserve(30));
  EXPECT_FALSE(budget.Reserve(1));
}

TEST(CacheBudgetTest, WhoAsksForMuchIsNotPassedByWhoAsksLater) {
  CacheBudget budget(100);
  ASSERT_TRUE(budget.AwaitReserve(30, Stop()).ok());
  const Stop much;
  const Stop little;
  absl::Status first;
  absl::Status second;
  std::jthread asks_for_much([&] { first = budget.AwaitReserve(40, much); });
  absl::SleepFor(absl::Milliseconds(20));
  std::jthread asks_for_little([&] { second = budget.AwaitReserve(10, little); });
  absl::SleepFor(absl::Milliseconds(20));
  little.Request();
  asks_for_little.join();
  EXPECT_EQ(second.code(), absl::StatusCode::kCancelled) << "it went before who came first";
  much.Request();
  asks_for_much.join();
  EXPECT_EQ(first.code(), absl::StatusCode::kCancelled);
  const Stop soon(SteadyNow() + testing::kPatience);
  EXPECT_TRUE(budget.AwaitReserve(20, soon).ok()) << "who left still stands in the way";
}

TEST(CacheBudgetTest, SmallSharesDoNotWaitForWhatIsReserved) {
  const auto budget = std::make_shared<CacheBudget>(320);
  Cache cache(budget);
  for (int i = 0; i < 10; ++i) cache.Put(i, Text("x"), 28);
  ASSERT_TRUE(budget->Reserve(160));
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(budget->AwaitSmallShare(Stop()).ok()) << i;
  EXPECT_EQ(budget->cached_bytes(), 0U) << "all is taken";
  const Stop stop;
  stop.Request();
  EXPECT_EQ(budget->AwaitSmallShare(stop).code(), absl::StatusCode::kCancelled);
  EXPECT_FALSE(budget->Reserve(1));
  budget->Release(160);
  budget->ReleaseSmallShare();
  EXPECT_TRUE(budget->AwaitSmallShare(Stop()).ok());
  EXPECT_TRUE(budget->Reserve(160));
}

}  // namespace
}  // namespace strata
