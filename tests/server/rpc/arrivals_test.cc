#include "server/rpc/arrivals.h"

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const absl::Time kStart = absl::FromUnixSeconds(1'000'000);

TEST(ArrivalsTest, AClientThatHasAllItMayHaveWaitsUntilOneHasGone) {
  Arrivals arrivals(2);
  EXPECT_TRUE(arrivals.Enter("robot", 0, kStart).in);
  EXPECT_TRUE(arrivals.Enter("robot", 0, kStart).in);
  EXPECT_FALSE(arrivals.Enter("robot", 0, kStart).in);
  EXPECT_TRUE(arrivals.Enter("other", 0, kStart).in);
  arrivals.Begin("robot", kStart);
  EXPECT_FALSE(arrivals.Enter("robot", 0, kStart).in);
  arrivals.Leave("robot");
  EXPECT_TRUE(arrivals.Enter("robot", 0, kStart).in);
  EXPECT_FALSE(arrivals.Enter("robot", 0, kStart).in);
}

// Nobody hears of a call that is cancelled before its handler begins.
TEST(ArrivalsTest, CallsThatAreOvertakenAreForgotten) {
  Arrivals arrivals(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(arrivals.Enter("robot", 0, kStart).in);
  const absl::Time later = kStart + absl::Minutes(1);
  EXPECT_TRUE(arrivals.Enter("robot", 0, later).in);
  EXPECT_FALSE(arrivals.Enter("robot", 0, later).in);
  arrivals.Begin("robot", later);
  EXPECT_TRUE(arrivals.Enter("robot", 0, later).in);
}

TEST(ArrivalsTest, WhileNoHandlerBeginsAHundredCallsASecondAreLetIn) {
  Arrivals arrivals(20);
  int entered = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (arrivals.Enter("robot", 0, kStart + absl::Milliseconds(i)).in) ++entered;
  }
  EXPECT_GE(entered, 20 + 9'900);
  EXPECT_LE(entered, 20 + 10'000);
}

TEST(ArrivalsTest, OfOneWhoseCallsAreRefusedByTheHundredsTheConnectionsMustGo) {
  Arrivals arrivals(1);
  const auto enter = [&](absl::string_view client, int lane, absl::Time now) {
    return arrivals.Enter(client, lane, now).cut_lanes;
  };
  EXPECT_THAT(enter("robot", 7, kStart), IsEmpty());  // is let in
  for (int i = 0; i < 499; ++i) EXPECT_THAT(enter("robot", 3 + i % 2, kStart), IsEmpty());
  EXPECT_THAT(enter("robot", 4, kStart), ElementsAre(3, 4));
  EXPECT_THAT(enter("robot", 4, kStart), IsEmpty());  // begins anew
  EXPECT_THAT(enter("other", 4, kStart), IsEmpty());
  // A few a second are no attack, however long it goes on.
  for (int i = 1; i < 100'000; ++i) {
    EXPECT_THAT(enter("robot", 4, kStart + absl::Milliseconds(3 * i)), IsEmpty());
  }
}

TEST(ArrivalsTest, WhatRunsIsNeverForgotten) {
  Arrivals arrivals(3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(arrivals.Enter("robot", 0, kStart).in);
    arrivals.Begin("robot", kStart);
  }
  const absl::Time later = kStart + absl::Hours(1);
  EXPECT_TRUE(arrivals.Enter("robot", 0, later).in);
  arrivals.Begin("robot", later);
  EXPECT_FALSE(arrivals.Enter("robot", 0, later).in);
  arrivals.Leave("robot");
  EXPECT_FALSE(arrivals.Enter("robot", 0, later).in);
  arrivals.Leave("robot");
  EXPECT_TRUE(arrivals.Enter("robot", 0, later).in);
}

}  // namespace
}  // namespace strata::server
