#include "core/common/steady_time.h"

#include "absl/time/clock.h"
#include <gtest/gtest.h>

#include "core/common/stop.h"

namespace strata {
namespace {

TEST(SteadyTimeTest, BeginsAtTheWallClockAndGoesOn) {
  const absl::Time first = SteadyNow();
  EXPECT_LT(absl::AbsDuration(absl::Now() - first), absl::Minutes(1));
  absl::SleepFor(absl::Milliseconds(20));
  EXPECT_GE(SteadyNow() - first, absl::Milliseconds(20));
}

TEST(SteadyTimeTest, IsWhatAStopGoesBy) {
  const Stop stop(SteadyNow() + absl::Milliseconds(20));
  EXPECT_TRUE(stop.status().ok());
  absl::SleepFor(absl::Milliseconds(20));
  EXPECT_TRUE(absl::IsDeadlineExceeded(stop.status()));
}

}  // namespace
}  // namespace strata
