#include "core/engine/ingest/waiting_scans.h"

#include "absl/time/time.h"
#include <gtest/gtest.h>

namespace strata {
namespace {

absl::Time At(double seconds) { return absl::FromUnixSeconds(1000) + absl::Seconds(seconds); }

TEST(WaitingScansTest, EachWaitsSinceItWasAcknowledged) {
  WaitingScans scans(At(0));
  scans.Add(10, At(5));
  scans.Add(11, At(5.5));
  scans.Add(12, At(9));
  EXPECT_EQ(scans.Since(3), At(0)) << "from before";
  EXPECT_EQ(scans.Since(10), At(5));
  EXPECT_EQ(scans.Since(11), At(5)) << "within a second";
  EXPECT_EQ(scans.Since(12), At(9));
  EXPECT_EQ(scans.Since(99), At(9));
  scans.Clear();
  scans.Add(13, At(20));
  EXPECT_EQ(scans.Since(13), At(20));
}

// Ten days of a scan a second, of which none is integrated.
TEST(WaitingScansTest, MillionsAreKeptToAHundredthOfTheWait) {
  constexpr int kScans = 864'000;
  WaitingScans scans(At(0));
  for (int i = 1; i <= kScans; ++i) scans.Add(static_cast<ScanNumber>(i), At(i));
  for (int oldest = 1; oldest <= kScans; oldest += 86'399) {
    const absl::Time since = scans.Since(static_cast<ScanNumber>(oldest));
    EXPECT_LE(since, At(oldest));
    EXPECT_GE(since, At(oldest) - absl::Seconds(kScans / 100)) << oldest;
  }
}

}  // namespace
}  // namespace strata
