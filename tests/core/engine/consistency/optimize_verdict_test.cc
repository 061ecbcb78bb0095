// What an optimize job says of what it found.
#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using OptimizeVerdictTest = YardTest;

// One scan of another place among many that agree, tied to them by a person.
TEST_F(OptimizeVerdictTest, PairsThatContradictEachOtherAreNamedAndNotGood) {
  MakeWorld();
  EXPECT_THAT(Optimize({{"dry_run", "1"}}).message, HasSubstr("are measured. Good."));
  const Pose said = TruthOf(kScans + 1);
  const PointCloud cloud = SimulateScan(CampusWorld().scene, SensorOptions(), said, 7);
  STRATA_ASSERT_OK(
      Upload(db(), HeaderOf({"run", kScans + 1}, cloud, said, Alignment::kOff), cloud));
  WaitIntegrated(db());
  Constraint joins;
  joins.i = {"run", kScans};
  joins.j = {"run", kScans + 1};
  joins.T_i_j = TruthOf(kScans).inverse() * said;
  joins.information = 1e6 * Matrix6d::Identity();
  STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, joins));
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_THAT(job.message,
              HasSubstr("in 1 of 6 pairs one scan looks through what the other saw (run/6 and "
                        "run/7)"));
  EXPECT_THAT(job.message, HasSubstr("Usable; look at these pairs."));
}

TEST_F(OptimizeVerdictTest, WhatMaySlideIsSaidBesideWhatNothingJoins) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= 8; ++k) {
    const Pose truth = PoseAt(2.0 * static_cast<double>(k % 4), 0.0);
    const Pose said = k <= 4 ? truth : PoseAt(0.0, 300.0) * truth;
    const PointCloud cloud = SeeFloor(truth, k);
    const ScanId id{k <= 4 ? "run" : "stray", k};
    STRATA_ASSERT_OK(Upload(db(), HeaderOf(id, cloud, said, Alignment::kOn), cloud, 6000));
  }
  WaitIntegrated(db());
  const JobInfo job = Optimize();
  EXPECT_THAT(job.message,
              HasSubstr("6 may slide along what scans see, and are as good as the robot's word (to "
                        "run/2, run/3, run/4, …)"));
  EXPECT_EQ(job.metrics.at("steps_sliding"), 6.0);
  EXPECT_THAT(job.message, HasSubstr("Nothing joins stray/5 (with 3 more) to the rest"));
  EXPECT_THAT(job.message, HasSubstr("Good within each part but for what may slide."));
}

// Such poses may be off by metres, and further from the truth than before.
TEST_F(OptimizeVerdictTest, WhatDoesNotSettleAroundALooseStepIsProposed) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= kScans; ++k) {
    UploadScan(k, k < 4 ? TruthOf(k) : PoseAt(5.0, 60.0, 0.3) * TruthOf(k));
  }
  WaitIntegrated(db());
  const JobInfo job = Optimize({{"rounds", "1"}});
  EXPECT_EQ(job.state, JobState::kProposed) << job.message;
  EXPECT_THAT(job.message, HasSubstr("not settled after 1 round. "));
  EXPECT_THAT(job.message, HasSubstr("1 of 5 steps from scan to scan are the robot's word alone"));
  EXPECT_THAT(job.message, HasSubstr("Too little to be applied by itself"));
}

}  // namespace
}  // namespace strata::testing
