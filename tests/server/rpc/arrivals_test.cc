#include "server/rpc/arrivals.h"

#include "absl/time/time.h"
#include <gtest/gtest.h>

namespace strata::server {
namespace {

const absl::Time kStart = absl::FromUnixSeconds(1'000'000);

TEST(ArrivalsTest, AClientThatHasAllItMayHaveWaitsUntilOneHasGone) {
  Arrivals arrivals(2);
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_FALSE(arrivals.Enter("robot", kStart));
  EXPECT_TRUE(arrivals.Enter("other", kStart));
  arrivals.Leave("robot", kStart);
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_FALSE(arrivals.Enter("robot", kStart));
}

TEST(ArrivalsTest, CallsOfWhichNothingIsHeardAreForgotten) {
  Arrivals arrivals(2);
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_FALSE(arrivals.Enter("robot", kStart + absl::Seconds(1)));
  EXPECT_TRUE(arrivals.Enter("robot", kStart + absl::Minutes(1)));
  // They may come to their end nevertheless.
  for (int i = 0; i < 5; ++i) arrivals.Leave("robot", kStart + absl::Minutes(1));
  EXPECT_TRUE(arrivals.Enter("robot", kStart + absl::Minutes(1)));
}

}  // namespace
}  // namespace strata::server
