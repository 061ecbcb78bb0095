#include "core/common/retry_delay.h"

#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(RetryDelayTest, IsWhatWasSaidLast) {
  const absl::Status full = absl::ResourceExhaustedError("full");
  EXPECT_EQ(RetryDelayOf(full), std::nullopt);
  const absl::Status once = WithRetryDelay(full, absl::Seconds(3));
  EXPECT_EQ(RetryDelayOf(once), absl::Seconds(3));
  EXPECT_EQ(RetryDelayOf(WithRetryDelay(once, absl::ZeroDuration())), absl::ZeroDuration());
}

TEST(RetryDelayTest, IsNotShorterThanWhatWasSaid) {
  const absl::Status status = WithRetryDelay(absl::AbortedError("x"), absl::Microseconds(1200));
  EXPECT_EQ(RetryDelayOf(status), absl::Milliseconds(2));
}

TEST(RetryDelayTest, NothingFailsLater) {
  EXPECT_TRUE(WithRetryDelay(absl::OkStatus(), absl::Seconds(1)).ok());
  EXPECT_EQ(RetryDelayOf(WithRetryDelay(absl::OkStatus(), absl::Seconds(1))), std::nullopt);
}

}  // namespace
}  // namespace strata
