// Who waits for tiles that are committed and not shown yet.
#include "core/engine/map/snapshots.h"

#include <thread>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

TEST(SnapshotsTest, WhoWaitsIsToldWhenItIsShown) {
  Snapshots snapshots({1, 5});
  STRATA_EXPECT_OK(snapshots.AwaitPublished(5, Stop()));
  std::thread publisher([&] {
    absl::SleepFor(absl::Milliseconds(100));
    snapshots.Publish({1, 7});
  });
  STRATA_EXPECT_OK(snapshots.AwaitPublished(7, Stop()));
  EXPECT_EQ(snapshots.current().tile_version, 7U);
  publisher.join();
}

TEST(SnapshotsTest, AStopEndsTheWait) {
  const Snapshots snapshots({1, 5});
  EXPECT_THAT(snapshots.AwaitPublished(6, Stop(absl::Now() + absl::Milliseconds(100))),
              StatusIs(Code::kDeadlineExceeded, ::testing::_));
  const Stop stop;
  std::thread asked([&] {
    absl::SleepFor(absl::Milliseconds(100));
    stop.Request();
  });
  EXPECT_THAT(snapshots.AwaitPublished(6, stop), StatusIs(Code::kCancelled, ::testing::_));
  asked.join();
}

TEST(SnapshotsTest, TheEndOfTheMapEndsTheWait) {
  Snapshots snapshots({1, 5});
  std::thread closer([&] {
    absl::SleepFor(absl::Milliseconds(100));
    snapshots.Close(absl::UnavailableError("gone"));
    snapshots.Close(absl::CancelledError("later"));
  });
  EXPECT_THAT(snapshots.AwaitPublished(6, Stop()), StatusIs(Code::kUnavailable, HasSubstr("gone")));
  closer.join();
  STRATA_EXPECT_OK(snapshots.AwaitPublished(5, Stop()));  // which is shown
}

}  // namespace
}  // namespace strata::testing
