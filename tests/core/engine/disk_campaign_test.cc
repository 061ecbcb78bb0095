// Seeded samples of what tests/experiments/disk_campaign does at every moment of a map's life.
#include "tests/core/engine/disk_campaign.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <glog/logging.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::uint64_t kSeed = 20261122;

class DiskCampaignTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    FLAGS_minloglevel = google::GLOG_FATAL;  // errors are what this is about
    auto prepared = DiskCampaign::Prepare();
    STRATA_ASSERT_OK(prepared);
    disks_ = new DiskCampaign(*std::move(prepared));
  }
  static void TearDownTestSuite() {
    delete disks_;
    disks_ = nullptr;
  }
  void SetUp() override {
    RecordProperty("seed", std::to_string(kSeed));
    ASSERT_NE(disks_, nullptr);
  }
  // About `trials` of them, at moments that the seed chooses; none of the last, which another run
  // may not come to.
  static Sweep SampleOf(std::int64_t moments, std::int64_t trials) {
    Sweep sweep;
    sweep.seed = kSeed;
    sweep.every = std::max<std::int64_t>(1, moments / trials);
    sweep.first = sweep.every * static_cast<std::int64_t>(kSeed % 1000) / 1111;
    return sweep;
  }
  static void ExpectKept(const SweepResult& result, const std::string& what) {
    EXPECT_GT(result.trials, 0) << what << ", of " << result.moments << " moments";
    EXPECT_EQ(result.restarts, 0) << what;
    EXPECT_THAT(result.violations, IsEmpty()) << what;
  }

  static inline DiskCampaign* disks_ = nullptr;
};

TEST_F(DiskCampaignTest, WhatIsAcknowledgedOutlivesDisksThatFail) {
  const DiskCampaign& disks = *disks_;
  for (const DiskFault fault : {DiskFault::kWrite, DiskFault::kSync}) {
    const std::int64_t moments = disks.moments(fault);
    ExpectKept(disks.FailOnce(fault, SampleOf(moments, 1)), "once");
    ExpectKept(disks.FailUntilMended(fault, SampleOf(moments, 1)), "until mended");
  }
  for (const DiskFault fault : {DiskFault::kWrite, DiskFault::kRead, DiskFault::kShm}) {
    // Two thirds of the writes of an opening come at its close, where nobody is told of them.
    ExpectKept(disks.FailOnOpening(fault, SampleOf(disks.moments_of_opening(fault), 8)),
               absl::StrCat("opening, fault ", static_cast<int>(fault)));
  }
  ExpectKept(disks.FillUp(SampleOf(disks.bytes(), 2)), "full");
}

TEST_F(DiskCampaignTest, WhatIsAcknowledgedOutlivesThePower) {
  const DiskCampaign& disks = *disks_;
  ExpectKept(disks.CutPower(false, SampleOf(disks.cuts(), 3)), "power");
  // It could tell.
  EXPECT_THAT(disks.CutPower(true, SampleOf(disks.cuts(), 2)).violations, Not(IsEmpty()));
}

}  // namespace
}  // namespace strata::testing
