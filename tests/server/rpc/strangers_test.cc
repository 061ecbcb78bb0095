#include "server/rpc/strangers.h"

#include <optional>

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

const absl::Time kStart = absl::FromUnixSeconds(1'800'000'000);

TEST(StrangersTest, AnAddressThatAsksTooOftenIsToldToWaitAndOthersAreNot) {
  Strangers strangers({.calls_per_second = 1.0, .burst = 3.0});
  for (int i = 0; i < 3; ++i) EXPECT_THAT(strangers.Enter("here", kStart), IsOk());
  const absl::Status refused = strangers.Enter("here", kStart);
  EXPECT_THAT(refused, StatusIs(Code::kResourceExhausted, HasSubstr("without a token")));
  EXPECT_EQ(translate::DetailOf(refused)->reason(), "CLIENT_LIMIT");
  EXPECT_EQ(RetryDelayOf(refused), absl::Seconds(1));
  EXPECT_THAT(strangers.Enter("there", kStart), IsOk());
  EXPECT_THAT(strangers.Enter("here", kStart + absl::Seconds(1)), IsOk());
}

TEST(StrangersTest, ManyAddressesTogetherAreLimitedToo) {
  Strangers strangers({.all_per_second = 1.0, .all_burst = 10.0});
  int taken = 0;
  for (int i = 0; i < 100; ++i) taken += strangers.Enter(absl::StrCat(i), kStart).ok() ? 1 : 0;
  EXPECT_EQ(taken, 10);
}

TEST(StrangersTest, FewAreHeardAndTheOthersAreCounted) {
  Strangers strangers({.heard_per_second = 1.0, .heard_burst = 2.0});
  EXPECT_TRUE(strangers.Hear(0, kStart).in);
  EXPECT_TRUE(strangers.Hear(0, kStart).in);
  EXPECT_FALSE(strangers.Hear(0, kStart).in);
  EXPECT_EQ(strangers.ToLog(kStart), 2U);
  EXPECT_TRUE(strangers.Hear(0, kStart + absl::Seconds(1)).in);
}

// However slowly their requests come in: each may be as large as the largest.
TEST(StrangersTest, FewAreHeardAtOnce) {
  Strangers strangers({.heard_at_once = 2});
  EXPECT_TRUE(strangers.Hear(0, kStart).in);
  EXPECT_TRUE(strangers.Hear(0, kStart).in);
  const absl::Time later = kStart + absl::Seconds(20);
  EXPECT_FALSE(strangers.Hear(0, later).in);
  strangers.Leave();
  EXPECT_TRUE(strangers.Hear(0, later).in);
  EXPECT_FALSE(strangers.Hear(0, later).in);
  // Those whose calls were cancelled before their handlers ran never leave.
  EXPECT_TRUE(strangers.Hear(0, kStart + absl::Seconds(31)).in);
  EXPECT_FALSE(strangers.Hear(0, kStart + absl::Seconds(31)).in);
}

TEST(StrangersTest, WhereHundredsASecondAreRefusedTheirConnectionsMustGo) {
  Strangers strangers({.heard_per_second = 1.0, .heard_burst = 1.0});
  EXPECT_TRUE(strangers.Hear(0, kStart).in);
  for (int i = 0; i < 100'000; ++i) {
    EXPECT_TRUE(strangers.Hear(0, kStart + absl::Milliseconds(3 * i)).cut_lanes.empty());
  }
  const absl::Time later = kStart + absl::Minutes(10);
  EXPECT_TRUE(strangers.Hear(1, later).in);
  for (int i = 0; i < 499; ++i) EXPECT_TRUE(strangers.Hear(2, later).cut_lanes.empty());
  EXPECT_EQ(strangers.Hear(2, later).cut_lanes, std::vector<int>{2});
}

TEST(StrangersTest, OneLineASecondTellsOfAll) {
  Strangers strangers({});
  EXPECT_EQ(strangers.ToLog(kStart), 1U);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(strangers.ToLog(kStart + absl::Milliseconds(i)), std::nullopt);
  }
  EXPECT_EQ(strangers.ToLog(kStart + absl::Seconds(1)), 501U);
}

}  // namespace
}  // namespace strata::server
