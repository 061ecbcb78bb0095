#include "core/engine/map/change_log.h"

#include <cstdint>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

api::TileChangeNotice Tile(std::int32_t x, std::uint64_t version, bool gone = false) {
  return {.key = {0, x, 0}, .version = version, .gone = gone};
}

TEST(ChangeLogTest, TheEndOfTheMapEndsTheWait) {
  ChangeLog log(10);
  std::thread closer([&] {
    absl::SleepFor(absl::Milliseconds(100));
    log.Close(absl::UnavailableError("gone"));
  });
  EXPECT_THAT(log.Await(10, Stop()), StatusIs(Code::kUnavailable, _));
  closer.join();
  STRATA_EXPECT_OK(log.Await(9, Stop()));
}

TEST(ChangeLogTest, TellsWhatIsNewer) {
  ChangeLog log(10);
  log.Add(12, {{"run", 1}}, {Tile(1, 12)});
  log.Add(15, {{"run", 2}}, {Tile(2, 15)});
  const ChangeSet all = log.Since(10);
  EXPECT_TRUE(all.complete);
  EXPECT_EQ(all.last, 15U);
  EXPECT_THAT(all.scans, ElementsAre(ScanId{"run", 1}, ScanId{"run", 2}));
  EXPECT_THAT(all.tiles, SizeIs(2));
  const ChangeSet newer = log.Since(12);
  EXPECT_THAT(newer.scans, ElementsAre(ScanId{"run", 2}));
  ASSERT_THAT(newer.tiles, SizeIs(1));
  EXPECT_EQ(newer.tiles.begin()->second.version, 15U);
  // Between two commits is after the one.
  EXPECT_THAT(log.Since(14).scans, ElementsAre(ScanId{"run", 2}));
  for (const std::uint64_t at : {15, 16, 1000}) {
    const ChangeSet nothing = log.Since(at);
    EXPECT_TRUE(nothing.complete);
    EXPECT_EQ(nothing.last, 15U);
    EXPECT_THAT(nothing.scans, IsEmpty());
    EXPECT_THAT(nothing.tiles, IsEmpty());
  }
}

TEST(ChangeLogTest, TellsWhenWhatIsInferredChangedLast) {
  ChangeLog log(10);
  EXPECT_EQ(log.Since(10).inferred, 0U);
  log.Add(12, {}, {}, true);
  log.Add(15, {{"run", 1}}, {});
  EXPECT_EQ(log.inferred(), 12U);
  EXPECT_EQ(log.Since(10).inferred, 12U);
  EXPECT_EQ(log.Since(15).inferred, 12U);  // whoever knows 15 knows it
  EXPECT_THAT(log.Since(10).tiles, IsEmpty());
  log.Add(16, {}, {}, true);
  EXPECT_EQ(log.Since(15).inferred, 16U);
}

TEST(ChangeLogTest, EachThingOnceAsItIsNow) {
  ChangeLog log(0);
  log.Add(1, {{"run", 1}}, {Tile(1, 1), Tile(2, 1)});
  log.Add(2, {{"run", 1}}, {Tile(1, 2)});
  log.Add(3, {}, {Tile(1, 3, true)});
  const ChangeSet set = log.Since(0);
  EXPECT_THAT(set.scans, SizeIs(1));
  ASSERT_THAT(set.tiles, SizeIs(2));
  EXPECT_EQ(set.tiles.at(Tile(1, 0).key).version, 3U);
  EXPECT_TRUE(set.tiles.at(Tile(1, 0).key).gone);
  EXPECT_EQ(set.tiles.at(Tile(2, 0).key).version, 1U);
}

TEST(ChangeLogTest, KnowsNothingOfTheTimeBeforeIt) {
  ChangeLog log(10);
  EXPECT_FALSE(log.Since(9).complete);
  EXPECT_EQ(log.Since(9).last, 10U);
  EXPECT_TRUE(log.Since(10).complete);
  log.Add(11, {{"run", 1}}, {});
  const ChangeSet old = log.Since(0);
  EXPECT_FALSE(old.complete);
  EXPECT_EQ(old.last, 11U);
  EXPECT_THAT(old.scans, IsEmpty());
}

TEST(ChangeLogTest, ACommitWithoutChangesMovesTheClockOnly) {
  ChangeLog log(3);
  log.Add(7, {}, {});
  EXPECT_EQ(log.Since(3).last, 7U);
  EXPECT_TRUE(log.Since(3).complete);
  EXPECT_THAT(log.Since(3).tiles, IsEmpty());
}

TEST(ChangeLogTest, IsBoundedAndSaysWhereItEnds) {
  constexpr std::uint64_t kCommits = 70'000;
  ChangeLog log(0);
  for (std::uint64_t at = 1; at <= kCommits; ++at) log.Add(at, {{"run", at}}, {});
  EXPECT_FALSE(log.Since(0).complete);
  EXPECT_THAT(log.Since(kCommits - 100).scans, SizeIs(100));
  // From the oldest complete answer on nothing is missing.
  std::uint64_t incomplete = 0;
  std::uint64_t complete = kCommits;
  while (complete - incomplete > 1) {
    const std::uint64_t middle = (complete + incomplete) / 2;
    (log.Since(middle).complete ? complete : incomplete) = middle;
  }
  EXPECT_GT(complete, 0U);
  EXPECT_LT(kCommits - complete, 1U << 17);
  EXPECT_THAT(log.Since(complete).scans, SizeIs(kCommits - complete));
  EXPECT_EQ(log.Since(complete).scans.begin()->sequence, complete + 1);
}

TEST(ChangeLogTest, ACommitThatIsHalfForgottenIsNotComplete) {
  ChangeLog log(0);
  log.Add(5, {{"run", 1}}, {});
  std::vector<ScanId> many;
  for (std::uint64_t k = 0; k < 70'000; ++k) many.push_back({"big", k});
  log.Add(6, many, {});
  EXPECT_FALSE(log.Since(0).complete);
  EXPECT_FALSE(log.Since(5).complete);
  EXPECT_TRUE(log.Since(6).complete);
}

TEST(ChangeLogTest, AwaitReturnsOnceThereIsSomethingNewer) {
  ChangeLog log(1);
  log.Add(2, {}, {});
  STRATA_EXPECT_OK(log.Await(1, Stop()));
  std::thread writer([&log] {
    absl::SleepFor(absl::Milliseconds(5));
    log.Add(3, {{"run", 1}}, {});
  });
  STRATA_EXPECT_OK(log.Await(2, Stop()));
  EXPECT_THAT(log.Since(2).scans, SizeIs(1));
  writer.join();
}

TEST(ChangeLogTest, AwaitEndsWithItsCall) {
  ChangeLog log(1);
  const Stop stop;
  stop.Request();
  EXPECT_THAT(log.Await(1, stop), StatusIs(Code::kCancelled, _));
  EXPECT_THAT(log.Await(1, Stop(absl::UnixEpoch())), StatusIs(Code::kDeadlineExceeded, _));
}

}  // namespace
}  // namespace strata::testing
