#include <atomic>
#include <cstdint>
#include <limits>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/sdk/connected_mock.h"

namespace strata::sdk {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::ElementsAre;
using ::testing::Return;
using Code = absl::StatusCode;

// A map that goes on by one commit, of one scan, with every look after the first.
class MapWatchTest : public ConnectedMock {
 protected:
  void SetUp() override {
    ConnectedMock::SetUp();
    ON_CALL(behind_.maps(), Watch(_, _, _, _))
        .WillByDefault([this](auto&, auto, const api::WatchOptions& options, auto sink) {
          api::MapUpdate update;
          EXPECT_EQ(options.epoch, looks_ == 0 ? 0U : 6U);
          update.commit_sequence = options.since + 1;
          update.epoch = 6;
          update.scans.push_back({{"run", update.commit_sequence}});
          ++looks_;
          return sink(update);
        });
  }

  std::atomic<int> looks_ = 0;
};

TEST_F(MapWatchTest, GoesOnWhereItWasWhenTheServerComesBack) {
  std::vector<std::uint64_t> seen;
  const absl::Status ended = client_->maps().Watch(
      {}, "m", {.since = 10, .trajectory = ""}, [&](const api::MapUpdate& update) {
        EXPECT_EQ(update.scans.size(), 1U);
        seen.push_back(update.commit_sequence);
        if (seen.size() == 2 || seen.size() == 4) RestartServer();
        return seen.size() == 6 ? absl::OutOfRangeError("enough") : absl::OkStatus();
      });
  EXPECT_THAT(ended, StatusIs(Code::kOutOfRange, "enough"));
  EXPECT_THAT(seen, ElementsAre(11U, 12U, 13U, 14U, 15U, 16U));
}

TEST_F(MapWatchTest, ASinksOwnErrorIsHandedBackWhateverItsCode) {
  int taken = 0;
  EXPECT_THAT(client_->maps().Watch({},
                                    "m",
                                    {},
                                    [&taken](const api::MapUpdate&) {
                                      ++taken;
                                      return absl::UnavailableError("my disk");
                                    }),
              StatusIs(Code::kUnavailable, "my disk"));
  EXPECT_EQ(taken, 1);
}

TEST_F(MapWatchTest, OnceEndsWithWhatThereIs) {
  std::vector<std::uint64_t> seen;
  EXPECT_THAT(client_->maps().Watch({},
                                    "m",
                                    {.since = 3, .trajectory = "", .once = true},
                                    [&](const api::MapUpdate& update) {
                                      seen.push_back(update.commit_sequence);
                                      return absl::OkStatus();
                                    }),
              IsOk());
  EXPECT_THAT(seen, ElementsAre(4U));
}

// Servers that are starting, for as long as the test says.
class AwayTest : public MapWatchTest {
 protected:
  void SetUp() override {
    MapWatchTest::SetUp();
    ON_CALL(behind_.maps(), Watch(_, _, _, _)).WillByDefault([this](auto&, auto, auto&, auto sink) {
      return ++looks_ <= away_ ? absl::UnavailableError("starting") : sink({});
    });
  }
  static absl::Status Enough(const api::MapUpdate&) { return absl::OutOfRangeError("enough"); }

  int away_ = std::numeric_limits<int>::max();
};

TEST_F(AwayTest, IsWaitedForHoweverLong) {
  away_ = 9;  // more than the attempts of other calls
  EXPECT_THAT(client_->maps().Watch({}, "m", {}, Enough), StatusIs(Code::kOutOfRange, "enough"));
  EXPECT_EQ(looks_, 10);
}

TEST_F(AwayTest, IsWaitedForByOnceAsByOtherCalls) {
  EXPECT_THAT(client_->maps().Watch({}, "m", {.trajectory = "", .once = true}, Enough),
              StatusIs(Code::kUnavailable, "starting"));
  EXPECT_EQ(looks_, BackoffOptions().max_attempts);
}

TEST_F(AwayTest, IsWaitedForUntilTheDeadline) {
  const api::Call call{Stop(absl::Now() + absl::Milliseconds(300)), "", ""};
  const absl::Status ended = client_->maps().Watch(call, "m", {}, Enough);
  EXPECT_TRUE(absl::IsUnavailable(ended) || absl::IsDeadlineExceeded(ended)) << ended;
}

TEST_F(AwayTest, IsNotWaitedForByOneWhoStops) {
  const api::Call call;
  std::thread impatient([&] {
    while (looks_ < 8) absl::SleepFor(absl::Milliseconds(1));
    call.stop.Request();
  });
  EXPECT_THAT(client_->maps().Watch(call, "m", {}, Enough), StatusIs(Code::kCancelled, _));
  impatient.join();
}

TEST_F(MapWatchTest, TheCallersStopEndsIt) {
  const api::Call call;
  EXPECT_THAT(client_->maps().Watch(call,
                                    "m",
                                    {},
                                    [&call](const api::MapUpdate&) {
                                      call.stop.Request();
                                      return absl::OkStatus();
                                    }),
              StatusIs(Code::kCancelled, _));
}

TEST_F(MapWatchTest, TheHistoryIsALookup) {
  EpochInfo epoch;
  epoch.epoch = 2;
  epoch.created = absl::UnixEpoch();
  epoch.reason = "job 5";
  EXPECT_CALL(behind_.maps(), History(_, _))
      .WillOnce(Return(absl::UnavailableError("starting")))
      .WillOnce(Return(std::vector<EpochInfo>{epoch}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, client_->maps().History({}, "m"));
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0].reason, "job 5");
}

}  // namespace
}  // namespace strata::sdk
