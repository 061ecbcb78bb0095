#include "server/rpc/client_limits.h"

#include <string>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/translate/status.h"
#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using Code = absl::StatusCode;
using Kind = ClientLimits::Kind;

const absl::Time kStart = absl::FromUnixSeconds(1'800'000'000);

TEST(ClientLimitsTest, OneClientsCallsLeaveRoomForAnothers) {
  ClientLimits limits({.max_calls = 2, .max_watches = 1});
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
  const absl::Status full = limits.Enter("a", Kind::kCall, kStart);
  EXPECT_THAT(full, StatusIs(Code::kResourceExhausted, HasSubstr("client a has 2 calls")));
  EXPECT_EQ(translate::DetailOf(full)->reason(), "CLIENT_LIMIT");
  EXPECT_GT(translate::RetryDelayOf(full), absl::ZeroDuration());
  EXPECT_THAT(limits.Enter("a", Kind::kWatch, kStart), IsOk());
  EXPECT_THAT(limits.Enter("a", Kind::kWatch, kStart),
              StatusIs(Code::kResourceExhausted, HasSubstr("1 watches")));
  EXPECT_THAT(limits.Enter("b", Kind::kCall, kStart), IsOk());
  limits.Leave("a", Kind::kCall);
  EXPECT_THAT(limits.Enter("a", Kind::kCall, kStart), IsOk());
}

TEST(ClientLimitsTest, TheRateHoldsInTheLongRunAndABurstAtOnce) {
  ClientLimits limits({.calls_per_second = 10.0, .burst = 5.0});
  const auto begun = [&limits](absl::Time now) {
    const absl::Status status = limits.Enter("a", Kind::kCall, now);
    if (status.ok()) limits.Leave("a", Kind::kCall);
    return status;
  };
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += begun(kStart).ok() ? 1 : 0;
  EXPECT_EQ(passed, 5);
  // Whoever waits as long as he is told gets in, and not much sooner.
  const absl::Duration wait = translate::RetryDelayOf(begun(kStart)).value();
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
  ClientLimits limits({.calls_per_second = 10.0, .burst = 5.0});
  EXPECT_THAT(limits.Enter("stays", Kind::kWatch, kStart), IsOk());
  for (int i = 0; i < 100'000; ++i) {
    const std::string name = absl::StrCat("10.0.", i / 256, ".", i % 256);
    ASSERT_THAT(limits.Enter(name, Kind::kCall, kStart + i * absl::Milliseconds(10)), IsOk());
    limits.Leave(name, Kind::kCall);
  }
  EXPECT_LE(limits.clients(), 1100);
  limits.Leave("stays", Kind::kWatch);
}

}  // namespace
}  // namespace strata::server
