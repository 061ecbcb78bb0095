#include "server/rpc/ticker.h"

#include <atomic>

#include "absl/synchronization/blocking_counter.h"
#include <gtest/gtest.h>

namespace strata::server {
namespace {

TEST(TickerTest, RunsAllThatWaitAtTheNextTickAndOnce) {
  Executor executor(2, "test");
  Ticker ticker(absl::Milliseconds(10), executor);
  for (int round = 0; round < 3; ++round) {
    std::atomic<int> runs = 0;
    absl::BlockingCounter all(10);
    for (int i = 0; i < 10; ++i) {
      ticker.AtNextTick("robot", [&] {
        ++runs;
        all.DecrementCount();
      });
    }
    all.Wait();
    EXPECT_EQ(runs, 10);
  }
}

TEST(TickerTest, EndsWhileNothingWaits) {
  Executor executor(1, "test");
  const Ticker ticker(absl::Hours(1), executor);
}

}  // namespace
}  // namespace strata::server
