// Optimize jobs whose server is killed at random moments, while eight robots upload and eight
// clients read.
#include <csignal>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/status.h"
#include "tests/integration/clients.h"
#include "tests/integration/crashes/epoch_ledger.h"
#include "tests/integration/crashes/yard_clients.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/asked.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

class OptimizeCrashTest : public ::testing::Test {
 protected:
  void SetUp() override {
    StartServer();
    STRATA_ASSERT_OK(db().maps().Create({}, kYardMap, {}));
    for (int robot = 1; robot <= kYardRobots; ++robot) {
      robots_.push_back(std::make_unique<YardRobot>(robot));
      YardRobot* const added = robots_.back().get();
      clients_.Add(address_, [added](auto& db, const auto& call) { added->Step(db, call); });
    }
    AllowScans();
    AwaitIntegrated();
  }
  void TearDown() override { clients_.Stop(); }

  // Starts or restarts the server; the first address stays.
  void StartServer() {
    server_.reset();
    server_ = std::make_unique<StratadProcess>(
        std::vector<std::string>{"--data",
                                 (directory_.path() / "maps").string(),
                                 "--listen",
                                 address_,
                                 "--optimize-every",
                                 "0"});
    address_ = server_->Address();
    ClientOptions options;
    options.target = address_;
    auto client = Connect(options);
    STRATA_ASSERT_OK(client);
    db_ = *std::move(client);
  }
  api::Database& db() { return *db_; }

  // Every robot may upload one scan more.
  void AllowScans() {
    ++allowed_;
    for (const auto& robot : robots_) robot->Allow(allowed_);
  }
  // Waits until every robot has sent what it may, and all of it is in the map.
  void AwaitIntegrated() {
    for (const auto& robot : robots_) {
      while (robot->acknowledged() < allowed_) absl::SleepFor(absl::Milliseconds(10));
    }
    while (true) {
      STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kYardMap));
      if (stats.scans_pending == 0) break;
      absl::SleepFor(absl::Milliseconds(10));
    }
  }
  void ExpectAcknowledgedIsThere() {
    for (const auto& robot : robots_) {
      const std::uint64_t acknowledged = robot->acknowledged();
      STRATA_ASSERT_OK_AND_ASSIGN(
          const UploadState state,
          db().scans().GetUploadState({}, kYardMap, robot->Id(1).trajectory));
      EXPECT_GE(state.last_sequence, acknowledged);
      EXPECT_EQ(state.scans, state.last_sequence);
    }
  }
  void ExpectPointsAreThere() {
    for (const auto& robot : robots_) {
      for (std::uint64_t sequence = 1; sequence <= robot->acknowledged(); ++sequence) {
        const ScanId id = robot->Id(sequence);
        PointCloud back;
        STRATA_EXPECT_OK(db().scans().GetPoints({}, kYardMap, id, [&back](const auto& piece) {
          back.points.insert(back.points.end(), piece.points.begin(), piece.points.end());
          return absl::OkStatus();
        }));
        EXPECT_EQ(back.points, SeeYard(id).points) << id.ToString();
      }
    }
  }

  // Says that robot1's first scan, and so everything, is higher or lower, and asks for an epoch
  // that agrees.
  std::uint64_t StartJob() {
    ++jobs_;
    if (prior_ != 0) {
      STRATA_EXPECT_OK(db().posegraph().RemoveConstraint({}, kYardMap, prior_));
    }
    Constraint prior;
    prior.j = YardScan(1, 1);
    prior.T_i_j = YardTruth(prior.j);
    prior.T_i_j.translation().z() += 0.3 * (jobs_ % 2) + 0.01 * jobs_;
    prior.information = Matrix6d::Identity() * 1e4;
    const auto added = db().posegraph().AddConstraint({}, kYardMap, prior);
    EXPECT_THAT(added, IsOk());
    prior_ = added.ok() ? added->id : 0;
    const auto job = db().jobs().Start({}, kYardMap, "optimize", {{"rounds", "2"}});
    EXPECT_THAT(job, IsOk());
    return job.ok() ? job->id : 0;
  }
  // Follows the job until it has come so far or ended.
  JobInfo Follow(std::uint64_t id, double progress) {
    JobInfo last;
    const absl::Status followed =
        db().jobs().Watch({}, kYardMap, id, [&](const JobInfo& now) -> absl::Status {
          last = now;
          const bool there = now.state == JobState::kRunning && now.progress >= progress;
          return there ? absl::OutOfRangeError("there") : absl::OkStatus();
        });
    EXPECT_TRUE(followed.ok() || absl::IsOutOfRange(followed)) << followed;
    return last;
  }
  void Kill() {
    server_->Signal(SIGKILL);
    EXPECT_EQ(server_->Wait(), -SIGKILL);
  }

  JobInfo Run(const std::string& kind) {
    const auto job = db().jobs().Start({}, kYardMap, kind, {});
    EXPECT_THAT(job, IsOk());
    return job.ok() ? Follow(job->id, 2.0) : JobInfo();
  }
  void ExpectTilesFollowFromThePoses() {
    const JobInfo verified = Run("verify");
    EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats before, db().maps().Stats({}, kYardMap));
    EXPECT_EQ(Run("rebuild").state, JobState::kSucceeded);
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kYardMap));
    EXPECT_EQ(after.content_digest, before.content_digest);
    EXPECT_EQ(after.scans, allowed_ * kYardRobots);
    EXPECT_EQ(after.scans_failed, 0);
  }
  // A job makes one epoch, killed or not.
  void ExpectOneEpochAJob() {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, db().maps().History({}, kYardMap));
    std::map<std::uint64_t, int> made;
    for (const EpochInfo& epoch : epochs) ++made[epoch.job];
    for (const auto& [job, count] : made) EXPECT_EQ(count, 1) << "job " << job;
  }

  TempDir directory_;
  std::string address_ = "127.0.0.1:0";
  std::unique_ptr<StratadProcess> server_;
  std::unique_ptr<api::Database> db_;
  std::vector<std::unique_ptr<YardRobot>> robots_;
  std::uint64_t allowed_ = 0;
  int jobs_ = 0;
  std::uint64_t prior_ = 0;
  EpochLedger ledger_;
  Clients clients_;
};

TEST_F(OptimizeCrashTest, TheJobEndsAfterEveryRestartAndNoAnswerMixesEpochs) {
  const std::uint64_t kills = Asked("STRATA_KILLS", 2);
  const std::uint64_t seed = Asked("STRATA_SEED", 20261122);
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  Random random(seed);
  TileReader tiles(ledger_, false);
  TileReader held(ledger_, true);
  PoseReader poses(ledger_);
  PoseReader more_poses(ledger_);
  PlanReader plans(ledger_);
  PlanReader more_plans(ledger_);
  Watcher watcher(ledger_);
  Watcher other(ledger_);
  Clients readers;
  const auto add = [&](auto& reader) {
    readers.Add(address_, [&reader](auto& db, const auto& call) { reader.Step(db, call); });
  };
  add(tiles), add(held), add(poses), add(more_poses);
  add(plans), add(more_plans), add(watcher), add(other);
  std::uint64_t id = 0;
  for (std::uint64_t killed = 0; killed < kills;) {
    if (id == 0) id = StartJob();
    AllowScans();
    const JobInfo job = Follow(id, random.Uniform(0.0, 1.0));
    absl::SleepFor(absl::Milliseconds(random.Uniform(0.0, 60.0)));
    if (IsFinal(job.state)) {
      EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
      id = 0;
      continue;
    }
    Kill();
    std::cout << "killed at " << job.progress << ", " << job.phase << std::endl;
    ++killed;
    StartServer();
    ExpectAcknowledgedIsThere();
    if (random.Uniform(0.0, 1.0) < 0.3) continue;  // the same job once more
    EXPECT_EQ(Follow(id, 2.0).state, JobState::kSucceeded);
    id = 0;
  }
  if (id != 0) {
    EXPECT_EQ(Follow(id, 2.0).state, JobState::kSucceeded);
  }
  AwaitIntegrated();
  readers.Stop();
  watcher.ExpectKnowsAll(db());
  other.ExpectKnowsAll(db());
  const EpochLedger::Compared compared = ledger_.Compare();
  std::cout << jobs_ << " jobs, " << compared.epochs << " epochs with " << compared.marks
            << " marks and " << compared.plans << " paths compared, " << compared.poses_unknown
            << " not" << std::endl;
  EXPECT_GT(compared.epochs, 1U);
  EXPECT_LT(10 * compared.poses_unknown, compared.marks + compared.plans);
  EXPECT_GT(compared.plans, 0U);
  EXPECT_GT(ledger_.SmallestLift(YardScan(1, 1)), 0.1);  // or a mix would not be noticed
  EXPECT_GT(ledger_.SmallestLift(YardScan(8, 1)), 0.1);
  ExpectOneEpochAJob();
  ExpectPointsAreThere();
  ExpectTilesFollowFromThePoses();
}

}  // namespace
}  // namespace strata::testing
