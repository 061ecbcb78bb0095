// What the thread sanitizer is told of absl::Mutex and absl::Status, and that it still sees what no
// mutex guards.
#include <cstdlib>
#include <optional>
#include <thread>

#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

namespace strata::testing {
namespace {

void TwoThreads(const auto& work) {
  std::thread other(work);
  work();
  other.join();
}

TEST(TsanAbslTest, LockOrders) {
  absl::Mutex mutex;
  int count = 0;
  TwoThreads([&] {
    for (int i = 0; i < 1000; ++i) {
      absl::MutexLock lock(&mutex);
      ++count;
    }
  });
  EXPECT_EQ(count, 2000);
}

TEST(TsanAbslTest, WaitingOrders) {
  absl::Mutex mutex;
  int waits = 0;
  int value = 0;
  bool ready = false;
  bool taken = false;
  std::thread other([&] {
    absl::MutexLock lock(&mutex);
    while (!mutex.AwaitWithTimeout(absl::Condition(&ready), absl::Milliseconds(1))) ++waits;
    ++value;
    taken = true;
  });
  {
    absl::MutexLock lock(&mutex);
    value = 1;
    ready = true;
    mutex.Await(absl::Condition(&taken));
    EXPECT_EQ(value, 2);
  }
  other.join();
}

TEST(TsanAbslTest, CopiesOfAStatusAreFreedInOrder) {
  for (int i = 0; i < 100; ++i) {
    std::optional<absl::Status> status = absl::NotFoundError("tile 1/2/3");
    std::thread other([copy = *status] { EXPECT_EQ(copy.message(), "tile 1/2/3"); });
    EXPECT_EQ(status->message(), "tile 1/2/3");
    status.reset();
    other.join();
  }
}

// Both threads lock the same mutex all the time, but not around `naked`.
TEST(TsanAbslDeathTest, RaceBesideAMutexIsReported) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto race = [] {
    absl::Mutex mutex;
    int guarded = 0;
    int naked = 0;
    TwoThreads([&] {
      for (int i = 0; i < 10000; ++i) {
        ++naked;
        absl::MutexLock lock(&mutex);
        ++guarded;
      }
    });
    std::exit(guarded == 20000 ? 0 : 1);
  };
  constexpr int kExitCodeOfTsan = 66;
  EXPECT_EXIT(race(), ::testing::ExitedWithCode(kExitCodeOfTsan), "data race");
}

}  // namespace
}  // namespace strata::testing
