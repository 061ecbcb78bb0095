#include "client/sdk/backoff.h"

#include <gtest/gtest.h>

#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"

namespace strata::sdk {
namespace {

absl::Status WithDelay(int ms) {
  return WithRetryDelay(absl::ResourceExhaustedError("full"), absl::Milliseconds(ms));
}

const BackoffOptions kOptions = {
    .max_attempts = 5, .initial = absl::Milliseconds(100), .max = absl::Milliseconds(350)};

TEST(BackoffTest, PausesDoubleUpToTheirBoundAndEnd) {
  Backoff backoff(kOptions, [] { return 0.0; });
  const absl::Status away = absl::UnavailableError("away");
  EXPECT_EQ(backoff.NextPause(away), absl::Milliseconds(100));
  EXPECT_EQ(backoff.NextPause(away), absl::Milliseconds(200));
  EXPECT_EQ(backoff.NextPause(away), absl::Milliseconds(350));
  EXPECT_EQ(backoff.NextPause(away), absl::Milliseconds(350));
  EXPECT_EQ(backoff.NextPause(away), std::nullopt);
}

TEST(BackoffTest, ChanceShortensAPauseByUpToAHalf) {
  Backoff backoff(kOptions, [] { return 0.5; });
  EXPECT_EQ(backoff.NextPause(absl::UnavailableError("away")), absl::Milliseconds(75));
}

TEST(BackoffTest, TheServersLongerPauseCounts) {
  Backoff backoff(kOptions, [] { return 0.0; });
  EXPECT_EQ(backoff.NextPause(WithDelay(900)), absl::Milliseconds(900));
  EXPECT_EQ(backoff.NextPause(WithDelay(1)), absl::Milliseconds(200));
}

TEST(BackoffTest, OtherErrorsAreNotRepeated) {
  Backoff backoff(kOptions, [] { return 0.0; });
  EXPECT_EQ(backoff.NextPause(absl::NotFoundError("x")), std::nullopt);
  EXPECT_EQ(backoff.NextPause(absl::InternalError("x")), std::nullopt);
  // A message that is too large stays so.
  EXPECT_EQ(backoff.NextPause(absl::ResourceExhaustedError("x")), std::nullopt);
}

// A server that is ending: gRPC cancels the calls that still come in.
TEST(BackoffTest, WhatTheCallerDidNotCancelIsRepeated) {
  Backoff backoff(kOptions, [] { return 0.0; });
  EXPECT_EQ(backoff.NextPause(absl::CancelledError("CANCELLED")), absl::Milliseconds(100));
  EXPECT_TRUE(backoff.Wait(absl::CancelledError("CANCELLED"), Stop()));
  const Stop stopped;
  stopped.Request();
  EXPECT_FALSE(backoff.Wait(absl::CancelledError("CANCELLED"), stopped));
}

absl::Status Elsewhere() {
  return WithRetryDelay(WithMapOwner(absl::UnavailableError("elsewhere"), "b"), absl::Seconds(1));
}

// Twice round the servers without a pause, then as long as they ask for.
TEST(BackoffTest, OfSeveralServersTheNextIsAskedAtOnce) {
  Backoff backoff(kOptions, 3);
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT(*backoff.NextPause(Elsewhere()), absl::Milliseconds(10)) << i;
    }
    EXPECT_GE(*backoff.NextPause(Elsewhere()), absl::Seconds(1));
  }
  Backoff alone(kOptions, 1);
  EXPECT_GE(*alone.NextPause(Elsewhere()), absl::Seconds(1));
  alone.NoteServerNamed();
  EXPECT_LT(*alone.NextPause(Elsewhere()), absl::Milliseconds(10));
}

TEST(BackoffTest, SeveralServersGetMoreTimeThanAttempts) {
  BackoffOptions options = kOptions;
  options.max_attempts = 2;
  const absl::Status away = absl::UnavailableError("away");
  Backoff one(options, 1);
  EXPECT_NE(one.NextPause(away), std::nullopt);
  EXPECT_EQ(one.NextPause(away), std::nullopt);
  Backoff several(options, 2);
  for (int i = 0; i < 20; ++i) EXPECT_NE(several.NextPause(away), std::nullopt) << i;
  options.retry_for = absl::ZeroDuration();
  Backoff hasty(options, 2);
  EXPECT_NE(hasty.NextPause(away), std::nullopt);
  EXPECT_EQ(hasty.NextPause(away), std::nullopt);
}

TEST(BackoffTest, NoPauseOutlivesItsCall) {
  Backoff backoff(kOptions, [] { return 0.0; });
  const absl::Status away = absl::UnavailableError("away");
  EXPECT_FALSE(backoff.Wait(away, Stop(absl::UnixEpoch())));
  const Stop stopped;
  stopped.Request();
  EXPECT_FALSE(backoff.Wait(away, stopped));
}

}  // namespace
}  // namespace strata::sdk
