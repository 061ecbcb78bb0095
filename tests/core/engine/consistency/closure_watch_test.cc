#include "core/engine/consistency/closure_watch.h"

#include <cstdint>
#include <memory>
#include <string>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/doors/map.h"
#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class ClosureWatchTest : public YardTest {
 protected:
  // From its true pose.
  void UploadTrue(const ScanId& id, const Pose& T_map_scan, Alignment alignment) {
    const PointCloud cloud = See(T_map_scan, id.sequence);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf(id, cloud, T_map_scan, alignment), cloud, 6000));
  }
  // Scan `k`, from 1, of a robot whose way is `y_m` beside the other's.
  void Drive(const std::string& robot, double y_m, std::uint64_t k, Alignment alignment) {
    Pose pose = PoseAt(2.0 * static_cast<double>(k) - 6.0, y_m, 0.1 * static_cast<double>(k));
    pose.translation().z() = 1.2;
    UploadTrue({robot, k}, pose, alignment);
  }
  // The map's file in this test's hands; the engine is closed meanwhile.
  std::shared_ptr<Map> OpenMap() {
    WaitIntegrated(db());
    Close();
    absl::StatusOr<std::shared_ptr<Map>> map = Map::Open(
        kMapName, MapFile(), Options(), std::make_shared<CacheBudget>(Options().cache_bytes));
    EXPECT_THAT(map, IsOk());
    return map.value_or(nullptr);
  }
  // Optimize jobs that nobody asked for.
  std::vector<JobInfo> AutomaticJobs() {
    std::vector<JobInfo> found;
    const auto jobs = db().jobs().List({}, kMapName);
    EXPECT_THAT(jobs, IsOk());
    for (const JobInfo& job : *jobs) {
      if (job.kind == "optimize" && job.parameters.contains("automatic")) found.push_back(job);
    }
    return found;
  }
  void ReopenOptimizing() {
    EngineOptions options = Options();
    options.optimize_interval = absl::Milliseconds(20);
    Reopen(options);
  }
};

TEST_F(ClosureWatchTest, RobotsThatMeetWhileTheyAreAlignedAreAClosureOnce) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= 2; ++k) Drive("a", 0.0, k, Alignment::kOn);
  for (std::uint64_t k = 1; k <= 3; ++k) Drive("b", 1.0, k, Alignment::kOn);
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphWorld world, GraphWorld::Read(map->core()));
  EXPECT_EQ(CountFreshContacts(world, 0), 1U);
  EXPECT_EQ(CountFreshContacts(world, 2), 1U);
  EXPECT_EQ(CountFreshContacts(world, 3), 0U) << "the first scan of b made the contact";
  ClosureWatch watch(map->core());
  EXPECT_THAT(watch.Look(Stop()), IsOkAndHolds(1U));
  EXPECT_THAT(watch.Look(Stop()), IsOkAndHolds(0U));
}

TEST_F(ClosureWatchTest, PlacesThatNothingJoinsAreFound) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= 3; ++k) Drive("a", 0.0, k, Alignment::kOff);
  for (std::uint64_t k = 1; k <= 3; ++k) Drive("b", 1.0, k, Alignment::kOff);
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  ClosureWatch watch(map->core());
  const Stop stopped;
  stopped.Request();
  EXPECT_THAT(watch.Look(stopped), StatusIs(absl::StatusCode::kCancelled, ::testing::_));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::size_t found, watch.Look(Stop()));
  EXPECT_GT(found, 0U);
  EXPECT_THAT(watch.Look(Stop()), IsOkAndHolds(0U));
}

TEST_F(ClosureWatchTest, OneRobotOnNewGroundIsNoClosure) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= 3; ++k) Drive("a", 0.0, k, Alignment::kOn);
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  EXPECT_THAT(ClosureWatch(map->core()).Look(Stop()), IsOkAndHolds(0U));
}

TEST_F(ClosureWatchTest, AMapThatWasClosedOptimizesByItself) {
  ReopenOptimizing();
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= 2; ++k) Drive("a", 0.0, k, Alignment::kOn);
  Drive("b", 1.0, 1, Alignment::kOn);  // makes the contact
  WaitIntegrated(db());
  const absl::Time deadline = absl::Now() + kPatience;
  while (AutomaticJobs().empty() && absl::Now() < deadline) absl::SleepFor(absl::Milliseconds(10));
  ASSERT_FALSE(AutomaticJobs().empty());
  JobInfo last;
  STRATA_ASSERT_OK(
      db().jobs().Watch({}, kMapName, AutomaticJobs()[0].id, [&last](const JobInfo& info) {
        last = info;
        return absl::OkStatus();
      }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  EXPECT_EQ(last.metrics.at("scans"), 3.0);
  ExpectSound();
}

TEST_F(ClosureWatchTest, AProposalThatWaitsIsNotOvertaken) {
  ReopenOptimizing();
  MakeMap(MapParameters());
  Drive("a", 0.0, 1, Alignment::kOn);
  Drive("a", 0.0, 2, Alignment::kOn);
  WaitIntegrated(db());
  const JobInfo proposal = RunJob(db(), "optimize", {{"dry_run", "1"}});
  ASSERT_EQ(proposal.state, JobState::kProposed) << proposal.message;
  Drive("b", 1.0, 1, Alignment::kOn);
  WaitIntegrated(db());
  absl::SleepFor(absl::Milliseconds(200));
  EXPECT_THAT(AutomaticJobs(), ::testing::IsEmpty());
  EXPECT_THAT(db().jobs().Accept({}, kMapName, proposal.id), IsOk());
}

}  // namespace
}  // namespace strata::testing
