// Waits that end where there is no memory.
#include <cstdint>
#include <limits>

#include "absl/synchronization/notification.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "core/common/blocking.h"
#include "server/rpc/executor.h"
#include "tests/support/faults/failing_memory.h"
#include "tests/support/patience.h"

namespace strata::server {
namespace {

// A hang, not a slow machine.

TEST(ExecutorMemoryTest, WaitsBeginAndEndWithoutMemory) {
  for (const bool in_turn : {false, true}) {
    Executor executor(1, "test");
    absl::Notification waits;
    absl::Notification go_on;
    absl::Notification ended;
    executor.Submit("robot", [&] {
      {
        const BlockingScope blocking(in_turn);
        waits.Notify();
        go_on.WaitForNotification();
      }
      const BlockingScope again(in_turn);
      ended.Notify();
    });
    ASSERT_TRUE(waits.WaitForNotificationWithTimeout(testing::kPatience));
    const testing::FailingMemory none(0, std::numeric_limits<std::int64_t>::max());
    go_on.Notify();
    EXPECT_TRUE(ended.WaitForNotificationWithTimeout(testing::kPatience));
  }
}

}  // namespace
}  // namespace strata::server
