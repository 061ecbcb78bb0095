#include "server/rpc/executor.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

#include "absl/synchronization/blocking_counter.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "core/common/blocking.h"
#include "tests/support/patience.h"

namespace strata::server {
namespace {

// A hang, not a slow machine.

TEST(ExecutorTest, RunsTheTasksOfAClientInTheirOrder) {
  std::vector<int> order;
  {
    Executor executor(1, "test");
    for (int i = 0; i < 100; ++i) executor.Submit("robot", [&order, i] { order.push_back(i); });
  }
  ASSERT_EQ(order.size(), 100U);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST(ExecutorTest, AClientThatHoldsEveryPlaceKeepsNobodyWaiting) {
  absl::Notification over;
  absl::Notification answered;
  Executor executor(2, "test");
  for (int i = 0; i < 50; ++i) {
    executor.Submit("hostile", [&over] { over.WaitForNotification(); });
  }
  executor.Submit("healthy", [&answered] { answered.Notify(); });
  EXPECT_TRUE(answered.WaitForNotificationWithTimeout(testing::kPatience));
  EXPECT_EQ(executor.numbers().queued, 48U);
  over.Notify();
}

TEST(ExecutorTest, PlacesGoToWhoHoldsTheFewest) {
  absl::BlockingCounter few_left(5);
  Executor executor(1, "test");
  absl::Notification over;
  executor.Submit("many", [&over] { over.WaitForNotification(); });
  absl::Notification begin;
  executor.Submit("few", [&begin] { begin.WaitForNotification(); });
  // Both places are held, and every further task of "many" would keep one for good.
  for (int i = 0; i < 100; ++i) {
    executor.Submit("many", [&over] { over.WaitForNotification(); });
  }
  for (int i = 0; i < 5; ++i) executor.Submit("few", [&few_left] { few_left.DecrementCount(); });
  begin.Notify();
  few_left.Wait();
  over.Notify();
}

TEST(ExecutorTest, ATaskThatBlocksGivesItsPlaceBack) {
  absl::Notification reached;
  Executor executor(1, "test");
  for (int i = 0; i < 20; ++i) {
    executor.Submit("robot", [&reached] {
      const BlockingScope blocking;
      reached.WaitForNotification();
    });
  }
  executor.Submit("robot", [&reached] { reached.Notify(); });
  EXPECT_TRUE(reached.WaitForNotificationWithTimeout(testing::kPatience));
}

TEST(ExecutorTest, OneClientsBlockedTasksAreBounded) {
  constexpr std::size_t kMost = Executor::kMostBlocked / 4;
  absl::Notification over;
  Executor executor(2, "test");
  for (std::size_t i = 0; i < kMost + 10; ++i) {
    executor.Submit("hostile", [&over] {
      const BlockingScope blocking;
      over.WaitForNotification();
    });
  }
  absl::Notification answered;
  executor.Submit("healthy", [&answered] { answered.Notify(); });
  EXPECT_TRUE(answered.WaitForNotificationWithTimeout(testing::kPatience));
  const absl::Time until = absl::Now() + testing::kPatience;
  while (executor.numbers().blocked < kMost && absl::Now() < until) {
    absl::SleepFor(absl::Milliseconds(1));
  }
  EXPECT_EQ(executor.numbers().blocked, kMost);
  EXPECT_LE(executor.numbers().running, 3U);
  over.Notify();
}

TEST(ExecutorTest, WhoGoesOnInTurnTakesAPlaceAgain) {
  std::atomic<int> running = 0;
  std::atomic<int> most = 0;
  {
    Executor executor(2, "test");
    for (int i = 0; i < 30; ++i) {
      executor.Submit("robot", [&] {
        for (int round = 0; round < 20; ++round) {
          const int now = ++running;
          for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
          }
          std::this_thread::yield();
          --running;
          const BlockingScope blocking(/*in_turn=*/true);
          std::this_thread::yield();
        }
      });
    }
  }
  EXPECT_LE(most, 2);
}

TEST(ExecutorTest, WhatIsSubmittedRunsBeforeItEnds) {
  std::atomic<int> runs = 0;
  {
    Executor executor(3, "test");
    for (int i = 0; i < 200; ++i) {
      executor.Submit("robot " + std::to_string(i % 7), [&runs] {
        const BlockingScope blocking(/*in_turn=*/true);
        ++runs;
      });
    }
  }
  EXPECT_EQ(runs, 200);
}

}  // namespace
}  // namespace strata::server
