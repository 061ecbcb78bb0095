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
  arrivals.Begin("robot", kStart);
  EXPECT_FALSE(arrivals.Enter("robot", kStart));
  arrivals.Leave("robot");
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_FALSE(arrivals.Enter("robot", kStart));
}

// Nobody hears of a call that is cancelled before its handler begins.
TEST(ArrivalsTest, CallsThatAreOvertakenAreForgotten) {
  Arrivals arrivals(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(arrivals.Enter("robot", kStart));
  const absl::Time later = kStart + absl::Minutes(1);
  EXPECT_TRUE(arrivals.Enter("robot", later));
  EXPECT_FALSE(arrivals.Enter("robot", later));
  arrivals.Begin("robot", later);
  EXPECT_TRUE(arrivals.Enter("robot", later));
}

TEST(ArrivalsTest, WhileNoHandlerBeginsAHundredCallsASecondAreLetIn) {
  Arrivals arrivals(20);
  int entered = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (arrivals.Enter("robot", kStart + absl::Milliseconds(i))) ++entered;
  }
  EXPECT_GE(entered, 20 + 9'900);
  EXPECT_LE(entered, 20 + 10'000);
}

TEST(ArrivalsTest, OfOneWhoseCallsAreRefusedByTheHundredsTheConnectionMustGo) {
  Arrivals arrivals(2);
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  EXPECT_FALSE(arrivals.Begin("robot", kStart));
  EXPECT_TRUE(arrivals.Enter("robot", kStart));
  for (int i = 0; i < 1'000; ++i) EXPECT_FALSE(arrivals.Enter("robot", kStart));
  EXPECT_TRUE(arrivals.Begin("robot", kStart));
  EXPECT_FALSE(arrivals.Begin("robot", kStart));  // one call of one connection
  EXPECT_TRUE(arrivals.Enter("other", kStart));
  EXPECT_FALSE(arrivals.Begin("other", kStart));
  // A few a second are no attack, however long it goes on.
  for (int i = 1; i < 100'000; ++i) {
    const absl::Time now = kStart + absl::Milliseconds(10 * i);
    EXPECT_FALSE(arrivals.Enter("robot", now) && arrivals.Begin("robot", now));
  }
}

TEST(ArrivalsTest, WhatRunsIsNeverForgotten) {
  Arrivals arrivals(3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(arrivals.Enter("robot", kStart));
    arrivals.Begin("robot", kStart);
  }
  const absl::Time later = kStart + absl::Hours(1);
  EXPECT_TRUE(arrivals.Enter("robot", later));
  arrivals.Begin("robot", later);
  EXPECT_FALSE(arrivals.Enter("robot", later));
  arrivals.Leave("robot");
  EXPECT_FALSE(arrivals.Enter("robot", later));
  arrivals.Leave("robot");
  EXPECT_TRUE(arrivals.Enter("robot", later));
}

}  // namespace
}  // namespace strata::server
