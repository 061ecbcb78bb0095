#include "core/common/stop.h"

#include <thread>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TEST(StopTest, NeverStopsByItself) {
  const Stop stop;
  STRATA_EXPECT_OK(stop.status());
  EXPECT_EQ(stop.deadline(), absl::InfiniteFuture());
}

TEST(StopTest, RequestOnACopyInAnotherThreadIsSeen) {
  const Stop stop(absl::Now() + absl::Hours(1));
  STRATA_EXPECT_OK(stop.status());
  std::thread([copy = stop] { copy.Request(); }).join();
  EXPECT_TRUE(stop.requested());
  EXPECT_THAT(stop.status(), StatusIs(absl::StatusCode::kCancelled, HasSubstr("cancelled")));
}

TEST(StopTest, PastDeadlineStopsAndCancellationGoesFirst) {
  const Stop stop(absl::Now() - absl::Seconds(1));
  EXPECT_THAT(stop.status(),
              StatusIs(absl::StatusCode::kDeadlineExceeded, HasSubstr("deadline passed")));
  stop.Request();
  EXPECT_THAT(stop.status(), StatusIs(absl::StatusCode::kCancelled, HasSubstr("cancelled")));
}

TEST(StopTest, SeparateStopsShareNothing) {
  const Stop one;
  const Stop other;
  one.Request();
  STRATA_EXPECT_OK(other.status());
}

}  // namespace
}  // namespace strata
