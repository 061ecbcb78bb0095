#include "server/rpc/client_limits.h"

#include <cstddef>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "proto/translate/status.h"
#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using Code = absl::StatusCode;
using Kind = ClientLimits::Kind;

constexpr std::size_t kAnyBytes = std::size_t{1} << 40;
const absl::Time kStart = absl::FromUnixSeconds(1'800'000'000);

TEST(ClientLimitsTest, OneClientsCallsLeaveRoomForAnothers) {
  ClientLimits limits({.max_calls = 2, .max_watches = 1}, kAnyBytes);
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  const absl::Status full = limits.Enter("a", Kind::kCall, kStart);
  EXPECT_THAT(full, StatusIs(Code::kResourceExhausted, HasSubstr("client a has 2 calls")));
  EXPECT_EQ(translate::DetailOf(full)->reason(), "CLIENT_LIMIT");
  EXPECT_GT(RetryDelayOf(full), absl::ZeroDuration());
  EXPECT_THAT(limits.Enter("a", Kind::kWatch, kStart), IsOk());
  EXPECT_THAT(limits.Enter("a", Kind::kWatch, kStart),
              StatusIs(Code::kResourceExhausted, HasSubstr("1 watches")));
  EXPECT_THAT(limits.Enter("b", Kind::kCall, kStart), IsOk());
  limits.Leave("a", Kind::kCall);
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
}

TEST(ClientLimitsTest, TheRateHoldsInTheLongRunAndABurstAtOnce) {
  ClientLimits limits({.calls_per_second = 10.0, .burst = 5.0}, kAnyBytes);
  const auto begun = [&limits](absl::Time now) {
    const absl::Status status = limits.Enter("a", Kind::kCall, now);
    if (status.ok()) limits.Leave("a", Kind::kCall);
    return status;
  };
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += begun(kStart).ok() ? 1 : 0;
  EXPECT_EQ(passed, 5);
  // Whoever waits as long as he is told gets in, and not much sooner.
  const absl::Duration wait = RetryDelayOf(begun(kStart)).value();
  EXPECT_EQ(wait, absl::Milliseconds(100));
  EXPECT_THAT(begun(kStart + wait / 2), StatusIs(Code::kResourceExhausted, HasSubstr("10 calls")));
  EXPECT_THAT(begun(kStart + wait), IsOk());
  // A thousand seconds at 20 a second.
  passed = 0;
  const absl::Time later = kStart + absl::Seconds(10);
  for (int i = 0; i < 20'000; ++i) {
    passed += begun(later + i * absl::Milliseconds(50)).ok() ? 1 : 0;
  }
  EXPECT_NEAR(passed, 10'000 + 5, 2);
  // A clock that goes back gives nothing and takes nothing.
  EXPECT_FALSE(begun(kStart).ok() && begun(kStart).ok());
}

TEST(ClientLimitsTest, WhoCameOnceIsForgotten) {
  ClientLimits limits({.calls_per_second = 10.0, .burst = 5.0}, kAnyBytes);
  EXPECT_THAT(limits.Enter("stays", Kind::kWatch, kStart), IsOk());
  for (int i = 0; i < 100'000; ++i) {
    const std::string name = absl::StrCat("10.0.", i / 256, ".", i % 256);
    ASSERT_THAT(limits.Enter(name, Kind::kCall, kStart + i * absl::Milliseconds(10)), IsOk());
    limits.Leave(name, Kind::kCall);
  }
  EXPECT_LE(limits.clients(), 1100);
  limits.Leave("stays", Kind::kWatch);
}

TEST(ClientLimitsTest, MemoryIsBookedForAClientAndForAll) {
  ClientLimits limits({.max_bytes = 100}, 150);
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  EXPECT_THAT(limits.Enter("b", Kind::kCall, kStart), IsOk());
  {
    Booking first(limits, "a");
    Booking second(limits, "a");
    Booking others(limits, "b");
    EXPECT_THAT(first.Resize(60), IsOk());
    const absl::Status full = second.Resize(41);
    EXPECT_THAT(full, StatusIs(Code::kResourceExhausted, HasSubstr("client a hold 60 bytes")));
    EXPECT_EQ(translate::DetailOf(full)->reason(), "CLIENT_LIMIT");
    EXPECT_GT(RetryDelayOf(full), absl::ZeroDuration());
    EXPECT_THAT(second.Resize(40), IsOk());
    const absl::Status busy = others.Resize(51);
    EXPECT_EQ(translate::DetailOf(busy)->reason(), "SERVER_BUSY");
    EXPECT_GT(RetryDelayOf(busy), absl::ZeroDuration());
    EXPECT_THAT(others.Resize(50), IsOk());
    EXPECT_EQ(limits.held_bytes(), 150U);
    EXPECT_THAT(first.Resize(10), IsOk());
    const Booking moved = std::move(first);
    EXPECT_EQ(moved.bytes(), 10U);
    EXPECT_EQ(limits.held_bytes(), 100U);
  }
  EXPECT_EQ(limits.held_bytes(), 0U);
}

TEST(ClientLimitsTest, WhatAClientMayNeverHoldIsNotWorthTryingAgain) {
  ClientLimits limits({.max_bytes = 100}, kAnyBytes);
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  Booking booking(limits, "a");
  EXPECT_THAT(booking.Resize(70), IsOk());
  const absl::Status never = booking.Resize(101);  // in two steps, too
  EXPECT_THAT(never, StatusIs(Code::kResourceExhausted, HasSubstr("needs 101 bytes")));
  EXPECT_EQ(translate::DetailOf(never)->reason(), "REQUEST");
  EXPECT_EQ(booking.bytes(), 70U);
}

TEST(ClientLimitsTest, AClientWhoseAnswersAreOnTheirWayIsNotForgotten) {
  ClientLimits limits({}, kAnyBytes);
  EXPECT_THAT(limits.Enter("slow", Kind::kCall, kStart), IsOk());
  Booking booking(limits, "slow");
  EXPECT_THAT(booking.Resize(70), IsOk());
  limits.Leave("slow", Kind::kCall);
  for (int i = 0; i < 5000; ++i) {
    const std::string name = absl::StrCat("client", i);
    EXPECT_THAT(limits.Enter(name, Kind::kCall, kStart), IsOk());
    limits.Leave(name, Kind::kCall);
  }
  booking.Release();
  EXPECT_EQ(limits.held_bytes(), 0U);
}

}  // namespace
}  // namespace strata::server
