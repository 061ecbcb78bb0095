// Global consistency: from poses that are planted wrong to a map that agrees with itself.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/consistency/yard_fixture.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using Code = absl::StatusCode;
using OptimizeTest = YardTest;

TEST_F(OptimizeTest, ScansComeCloserToTruthInANewEpochThatVerifies) {
  MakeWorld();
  const MapStats before = WaitIntegrated(db());
  const double error = Error();
  ASSERT_GT(error, 0.08);
  const JobInfo job = Optimize();
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_LT(Error(), 0.25 * error);
  RecordProperty("error_mm", static_cast<int>(1000 * Error()));
  const MapStats after = WaitIntegrated(db());
  EXPECT_EQ(after.epoch, before.epoch + 1);
  EXPECT_NE(after.content_digest, before.content_digest);
  EXPECT_EQ(job.metrics.at("epoch"), static_cast<double>(after.epoch));
  EXPECT_EQ(job.metrics.at("scans_moved"), kScans - 1.0);
  EXPECT_GT(job.metrics.at("tiles_changed"), 0.0);
  ExpectSound();

  // The map is that of scans that were always there.
  ASSERT_EQ(RunJob(db(), "rebuild").metrics.at("tiles_changed"), 0.0);
  EXPECT_EQ(Digest(), after.content_digest);
  MakeMap(MapParameters(), "copy");
  for (std::uint64_t k = 1; k <= kScans; ++k) UploadScan(k, PoseOf(k), "copy");
  EXPECT_EQ(WaitIntegrated(db(), "copy").content_digest, after.content_digest);
  Reopen();
  EXPECT_EQ(Digest(), after.content_digest);
}

TEST_F(OptimizeTest, ThreadsDoNotShow) {
  MakeWorld();
  ASSERT_EQ(Optimize({{"threads", "1"}}).state, JobState::kSucceeded);
  const std::string digest = Digest();
  const std::vector<Pose> poses = Poses();
  ASSERT_EQ(RunJob(db(), "revert", {{"epoch", "1"}}).state, JobState::kSucceeded);
  ASSERT_EQ(Optimize({{"threads", "4"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), digest);
  ExpectEqual(Poses(), poses);
}

TEST_F(OptimizeTest, AWorldThatAgreesWithItselfStaysAsItIs) {
  MakeWorld();
  ASSERT_EQ(Optimize({{"rounds", "10"}}).state, JobState::kSucceeded);
  const MapStats settled = WaitIntegrated(db());
  const JobInfo again = Optimize({{"tolerance_m", "0.02"}, {"tolerance_rad", "0.005"}});
  ASSERT_EQ(again.state, JobState::kSucceeded) << again.message;
  EXPECT_EQ(again.metrics.at("scans_moved"), 0.0);
  EXPECT_EQ(WaitIntegrated(db()).epoch, settled.epoch);
  EXPECT_EQ(Digest(), settled.content_digest);
}

TEST_F(OptimizeTest, ADryRunIsAppliedLaterAndCarriesWhatCameMeanwhile) {
  MakeWorld();
  const std::vector<Pose> before = Poses();
  const std::string digest = Digest();
  const JobInfo job = Optimize({{"dry_run", "1"}});
  ASSERT_EQ(job.state, JobState::kProposed) << job.message;
  ExpectEqual(Poses(), before);
  EXPECT_EQ(Digest(), digest);
  EXPECT_THAT(Graph().planes, IsEmpty());

  UploadScan(kScans + 1, SaidOf(kScans + 1));  // on the trajectory
  const PointCloud cloud = See(TruthOf(2), 99);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"other", 1}, cloud, TruthOf(2)), cloud));
  WaitIntegrated(db());
  Reopen();  // a proposal survives
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));
  const JobInfo accepted = Follow(job.id);
  ASSERT_EQ(accepted.state, JobState::kSucceeded) << accepted.message;
  EXPECT_LT(Error(), 0.03);
  const Pose was = SaidOf(kScans).inverse() * SaidOf(kScans + 1);
  EXPECT_TRUE((PoseOf(kScans).inverse() * PoseOf(kScans + 1)).isApprox(was, 1e-9));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto other,
                              db().posegraph().LookupPose({}, kMapName, {"other", 1}));
  EXPECT_TRUE(other.T_map_scan.isApprox(TruthOf(2), 0.0));  // nothing held it against others
  ExpectSound();
}

// Every second scan is of another place; said to be of one.
class OptimizeOfTwoPlacesTest : public OptimizeTest {
 protected:
  static constexpr std::uint64_t kBoth = 12;
  void MakeMixedWorld() {
    MakeMap(MapParameters());
    const Scene campus = CampusWorld().scene;
    for (std::uint64_t k = 1; k <= kBoth; ++k) {
      const Pose said = TruthOf((k + 1) / 2);
      const PointCloud cloud =
          k % 2 == 0 ? SimulateScan(campus, SensorOptions(), said, k) : See(said, k);
      STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", k}, cloud, said), cloud));
    }
    WaitIntegrated(db());
  }
};

TEST_F(OptimizeOfTwoPlacesTest, IsProposedWithTheReason) {
  MakeMixedWorld();
  const std::vector<Pose> before = Poses();
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kProposed);
  EXPECT_THAT(job.message, HasSubstr("Too little to be applied by itself"));
  EXPECT_GT(job.metrics.at("steps_loose") + job.metrics.at("pairs_contradicted"), 5.0);
  ExpectEqual(Poses(), before);
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));  // a person may know better
  EXPECT_EQ(Follow(job.id).state, JobState::kSucceeded);
}

TEST_F(OptimizeOfTwoPlacesTest, ThatNobodyAskedForChangesNothing) {
  MakeMixedWorld();
  const std::vector<Pose> before = Poses();
  const JobInfo job = Optimize({{"automatic", "1"}});
  EXPECT_EQ(job.state, JobState::kSucceeded);
  EXPECT_THAT(job.message, HasSubstr("Too little to be applied by itself"));
  ExpectEqual(Poses(), before);
  EXPECT_EQ(WaitIntegrated(db()).epoch, 1U);
  EXPECT_THAT(db().jobs().Accept({}, kMapName, job.id), StatusIs(Code::kFailedPrecondition, _));
}

// Too few to matter in the whole, and all of them wrong.
TEST_F(OptimizeTest, ASmallPartThatContradictsTheRestIsProposedAndNamed) {
  MakeWorld();
  const Scene campus = CampusWorld().scene;
  const auto said = [](std::uint64_t k) {
    return TruthOf(kScans) * PoseAt(1.5 * static_cast<double>(k), 0.0);
  };
  for (std::uint64_t k = 1; k <= 3; ++k) {
    const PointCloud cloud = SimulateScan(campus, SensorOptions(), said(k), k);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"stray", k}, cloud, said(k), Alignment::kOff), cloud));
  }
  WaitIntegrated(db());
  const JobInfo apart = Optimize({{"dry_run", "1"}});
  EXPECT_THAT(apart.message, HasSubstr("Nothing joins stray/1 (with 2 more) to the rest"));
  EXPECT_EQ(apart.metrics.at("parts_apart"), 1.0);
  EXPECT_THAT(apart.message, HasSubstr("Good within each part."));
  for (std::uint64_t k = 1; k <= 3; ++k) {
    Constraint joins;
    joins.i = k == 1 ? ScanId{"run", kScans} : ScanId{"stray", k - 1};
    joins.j = {"stray", k};
    joins.T_i_j = (k == 1 ? TruthOf(kScans) : said(k - 1)).inverse() * said(k);
    joins.information = 1e6 * Matrix6d::Identity();
    STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, joins));
  }
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kProposed);
  EXPECT_LE(job.metrics.at("pairs_contradicted"), 4.0);
  EXPECT_THAT(job.message, HasSubstr("most of run and stray"));
  EXPECT_THAT(job.message, HasSubstr("Too little to be applied by itself"));
}

TEST_F(OptimizeTest, AStepThatNobodyMeasuredIsNamedOnce) {
  MakeMap(MapParameters());
  for (std::uint64_t k = 1; k <= kScans; ++k) {
    UploadScan(k, k < 4 ? TruthOf(k) : PoseAt(5.0, 60.0, 0.3) * TruthOf(k));
  }
  WaitIntegrated(db());
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_THAT(job.message, HasSubstr("1 of 5 steps from scan to scan are the robot's word alone"))
      << job.message;
  EXPECT_THAT(job.message, HasSubstr("(to run/4)"));
  EXPECT_THAT(job.message, Not(HasSubstr("Nothing joins")));
  EXPECT_THAT(job.message, HasSubstr("Usable; look at these steps."));
}

// Robots on lanes across the yard, with sensors that see little of it from far away. Its corners
// look alike, turned by 90°.
class OptimizeOfLanesTest : public OptimizeTest {
 protected:
  static Pose Truth(int robot, std::uint64_t k) {
    constexpr double kLanes[] = {-12.0, -10.0, -3.0, -1.5, 0.0, 2.0, 9.0, 12.0};
    Pose truth = PoseAt(-18.0 + 2.0 * static_cast<double>(k), kLanes[robot - 1]);
    truth.translation().z() = 1.2;
    return truth;
  }
  void Drive(int robot, std::uint64_t k, std::uint64_t draw, double off_m, const std::string& map) {
    static const Scene* const yard = new Scene(YardScene());
    SensorOptions sensor;
    sensor.rings = 24;
    sensor.columns = 240;
    const std::uint64_t seed = 1000 * k + static_cast<std::uint64_t>(robot) + 100 * draw;
    Pose said = Truth(robot, k);
    const PointCloud cloud = SimulateScan(*yard, sensor, said, seed);
    said.translation().x() += off_m;
    const ScanId id{absl::StrCat("robot", robot), k};
    STRATA_ASSERT_OK(Upload(db(), HeaderOf(id, cloud, said, Alignment::kOn), cloud, 6000, map));
  }
  // The robots one after the other.
  void DriveAll(std::vector<int> robots,
                std::uint64_t scans,
                std::uint64_t draw,
                double off_m,
                const std::string& map) {
    MakeMap(MapParameters(), map);
    for (const int robot : robots) {
      const double off = robot == robots.back() ? off_m : 0.0;
      for (std::uint64_t k = 1; k <= scans; ++k) Drive(robot, k, draw, off, map);
    }
    WaitIntegrated(db(), map);
  }
};

TEST_F(OptimizeOfLanesTest, RobotsWhoseFramesAreOneAreNotJoinedWhereCornersLookAlike) {
  for (std::uint64_t draw = 0; draw < 3; ++draw) {
    const std::string map = absl::StrCat("yard", draw);
    SCOPED_TRACE(map);
    MakeMap(MapParameters(), map);
    for (const int robot : {8, 2, 1, 7, 3, 4, 5, 6}) Drive(robot, 1, draw, 0.0, map);
    Drive(2, 2, draw, 0.0, map);
    WaitIntegrated(db(), map);
    const JobInfo job = RunJob(db(), "optimize", {}, map);
    EXPECT_EQ(job.state, JobState::kSucceeded);
    EXPECT_LT(job.metrics.at("shift_max_m"), 0.1) << job.message;
  }
}

TEST_F(OptimizeOfLanesTest, CornersThatLookAlikeJoinNobodyWhoseFrameIsHisOwn) {
  for (std::uint64_t draw = 0; draw < 6; ++draw) {
    const std::string map = absl::StrCat("yard", draw);
    SCOPED_TRACE(map);
    DriveAll({8, 7, 2}, 2, draw, 100.0, map);
    EXPECT_LT(RunJob(db(), "optimize", {}, map).metrics.at("shift_max_m"), 0.1);
  }
}

// The walls at both ends, which nobody's other scans tie to each other.
TEST_F(OptimizeOfLanesTest, ARobotThatSharesOnlyWallsDoesNotSlideAlongThem) {
  for (const std::uint64_t scans : {5, 8}) {
    const std::string map = absl::StrCat("yard", scans);
    SCOPED_TRACE(map);
    DriveAll({8, 7, 2}, scans, scans, 0.0, map);
    EXPECT_LT(RunJob(db(), "optimize", {}, map).metrics.at("shift_max_m"), 0.1);
  }
}

// Where their ways cross they are nearest to each other, and one sees the deck that hides the
// other; what both see lies beside it.
TEST_F(OptimizeTest, ARobotUnderABridgeIsJoinedToOneThatDrivesOverIt) {
  MakeMap(MapParameters());
  const Scene bridge = BridgeWorld().scene;
  const Pose off = PoseAt(0.4, -0.3, 0.02);  // the frame of the second
  std::vector<Pose> truth;
  const auto record =
      [&](const std::string& robot, const std::vector<Pose>& way, const Pose& T_frame) {
        for (std::size_t k = 0; k < way.size(); ++k) {
          const PointCloud cloud = SimulateScan(bridge, {}, way[k], 40 + truth.size());
          const ScanHeader header = HeaderOf({robot, k}, cloud, T_frame * way[k], Alignment::kOn);
          STRATA_ASSERT_OK(Upload(db(), header, cloud, 40'000));
          truth.push_back(way[k]);
        }
      };
  record("over", Drive(bridge, {{-14, 0, 1.8}, {14, 0, 1.8}}, 1.0, 1.2), Pose::Identity());
  record("under", Drive(bridge, {{0, -14, 0}, {0, 14, 0}}, 1.0, 1.2), off);
  WaitIntegrated(db());
  const JobInfo job = RunJob(db(), "optimize", {});
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_THAT(job.message, Not(HasSubstr("Nothing joins"))) << job.message;
  const std::vector<Pose> poses = Poses();
  ASSERT_EQ(poses.size(), truth.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose is = poses[0].inverse() * poses[i];
    EXPECT_LT((is.translation() - (truth[0].inverse() * truth[i]).translation()).norm(), 0.1) << i;
  }
}

TEST_F(OptimizeTest, ScansThatNothingIsMatchedToAreNotMoved) {
  MakeMap(MapParameters());
  PointCloud cloud;  // too little to be matched
  for (int i = 0; i < 20; ++i) cloud.points.emplace_back(5.0F, 0.3F * static_cast<float>(i), 0.5F);
  for (std::uint64_t k = 1; k <= 7; ++k) {
    const Pose said = PoseAt(2.0 * static_cast<double>(k), 0.0);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", k}, cloud, said), cloud));
  }
  WaitIntegrated(db());
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kProposed);
  EXPECT_EQ(job.metrics.at("steps_loose"), 6.0);
  EXPECT_THAT(job.message, HasSubstr("6 of 6 steps"));
}

TEST_F(OptimizeTest, WhatAPersonSetMeanwhileStays) {
  MakeWorld();
  const JobInfo job = Optimize({{"dry_run", "1"}});
  const Pose by_hand = TruthOf(3) * PoseAt(0.5, 0.5, 0.1);
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 3}, by_hand));
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));
  ASSERT_EQ(Follow(job.id).state, JobState::kSucceeded);
  EXPECT_TRUE(PoseOf(3).isApprox(by_hand, 0.0));
  EXPECT_LT((PoseOf(4).translation() - TruthOf(4).translation()).norm(), 0.05);
  ExpectSound();
}

// Where nothing moves no epoch comes between them, and both are of the world as it is.
TEST_F(OptimizeTest, TwoProposalsBringTheirClosuresOnce) {
  MakeMap(MapParameters());
  for (const std::string robot : {"run", "other"}) {
    for (std::uint64_t k = 1; k <= kScans; ++k) {
      const PointCloud cloud = See(TruthOf(k), k + (robot == "run" ? 0 : 100));
      const ScanHeader header = HeaderOf({robot, k}, cloud, TruthOf(k), Alignment::kOff);
      STRATA_ASSERT_OK(Upload(db(), header, cloud));
    }
  }
  WaitIntegrated(db());
  const std::map<std::string, std::string> still = {
      {"dry_run", "1"}, {"closures", "1"}, {"tolerance_m", "1"}, {"tolerance_rad", "1"}};
  const JobInfo first = Optimize(still);
  const JobInfo second = Optimize(still);
  std::size_t closures = 0;
  for (const JobInfo& job : {first, second}) {
    ASSERT_EQ(job.state, JobState::kProposed) << job.message;
    EXPECT_GT(job.metrics.at("closures"), 0.0);
    STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));
    ASSERT_EQ(Follow(job.id).state, JobState::kSucceeded);
    if (closures == 0) closures = Graph().constraints.size();
  }
  EXPECT_GT(closures, 0U);
  EXPECT_EQ(Graph().constraints.size(), closures);
}

TEST_F(OptimizeTest, AProposalOfAnOldWorldIsNotApplied) {
  MakeWorld();
  const JobInfo old = Optimize({{"dry_run", "1"}});
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  const std::string digest = Digest();
  const std::vector<Pose> poses = Poses();
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, old.id));
  const JobInfo failed = Follow(old.id);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_THAT(failed.message, HasSubstr("epoch"));
  EXPECT_EQ(Digest(), digest);
  ExpectEqual(Poses(), poses);
  const JobInfo cancelled = Optimize({{"dry_run", "1"}});
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo busy, db().jobs().Start({}, kMapName, "rebuild", {}));
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, cancelled.id));
  STRATA_ASSERT_OK(db().jobs().Cancel({}, kMapName, cancelled.id));
  Follow(cancelled.id);
  Follow(busy.id);
  Close();  // nobody can accept what they proposed: it is gone
  EXPECT_EQ(
      Number("SELECT count(*) FROM truth_proposed_pose WHERE job = " + std::to_string(old.id)), 0);
  EXPECT_EQ(Number("SELECT (SELECT count(*) FROM truth_plane WHERE proposed_by <> 0) + (SELECT "
                   "count(*) FROM truth_proposed_pose)"),
            0);
}

TEST_F(OptimizeTest, AJobThatWasKilledAfterItsEpochMakesNoSecondOne) {
  for (const bool dry_run : {false, true}) {
    SCOPED_TRACE(dry_run);
    const std::string map = dry_run ? "proposed" : kMapName;
    MakeMap(MapParameters(), map);
    for (std::uint64_t k = 1; k <= 3; ++k) UploadScan(k, SaidOf(k), map);
    WaitIntegrated(db(), map);
    STRATA_ASSERT_OK_AND_ASSIGN(
        JobInfo job,
        db().jobs().Start(
            {}, map, "optimize", {{"closures", "0"}, {"dry_run", dry_run ? "1" : "0"}}));
    const auto follow = [&] {
      return db().jobs().Watch({}, map, job.id, [&job](const JobInfo& info) {
        job = info;
        return absl::OkStatus();
      });
    };
    STRATA_ASSERT_OK(follow());
    if (dry_run) {
      STRATA_ASSERT_OK(db().jobs().Accept({}, map, job.id));
      STRATA_ASSERT_OK(follow());
    }
    ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
    const MapStats made = WaitIntegrated(db(), map);
    EXPECT_EQ(made.epoch, 2U);
    Close();  // as if it had not come to say so
    Sql(absl::StrCat("UPDATE truth_job SET state = 2 WHERE id = ", job.id), map);
    Reopen();
    STRATA_ASSERT_OK(follow());
    EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
    EXPECT_EQ(WaitIntegrated(db(), map).epoch, made.epoch);
    EXPECT_EQ(WaitIntegrated(db(), map).content_digest, made.content_digest);
    STRATA_ASSERT_OK_AND_ASSIGN(job, db().jobs().Revert({}, map, job.id));
    STRATA_ASSERT_OK(follow());
    EXPECT_THAT(job.message, HasSubstr("epoch 1 are back"));
  }
}

TEST_F(OptimizeTest, AForgottenProposalLeavesNothing) {
  MakeWorld();
  const std::vector<Pose> before = Poses();
  const JobInfo job = Optimize({{"dry_run", "1"}});
  STRATA_ASSERT_OK(db().jobs().Revert({}, kMapName, job.id));
  Reopen();
  ExpectEqual(Poses(), before);
  EXPECT_THAT(Graph().planes, IsEmpty());
  EXPECT_THAT(db().jobs().Accept({}, kMapName, job.id), StatusIs(Code::kFailedPrecondition, _));
  ExpectSound();
}

TEST_F(OptimizeTest, EpochsAreBroughtBackToTheBit) {
  MakeWorld();
  const std::string digest = Digest();
  const std::vector<Pose> poses = Poses();
  const JobInfo job = Optimize();
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  const std::string optimized_digest = Digest();
  const std::vector<Pose> optimized = Poses();
  const std::size_t planes = Graph().planes.size();
  ASSERT_GT(planes, 0U);

  STRATA_ASSERT_OK(db().jobs().Start({}, kMapName, "rebuild", {}));  // it has to wait
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo undo, db().jobs().Revert({}, kMapName, job.id));
  EXPECT_THAT(db().jobs().Revert({}, kMapName, job.id), StatusIs(Code::kFailedPrecondition, _));
  ASSERT_EQ(Follow(undo.id).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), digest);
  ExpectEqual(Poses(), poses);
  EXPECT_THAT(Graph().planes, IsEmpty());

  ASSERT_EQ(RunJob(db(), "revert", {{"epoch", "2"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), optimized_digest);
  ExpectEqual(Poses(), optimized);
  EXPECT_EQ(Graph().planes.size(), planes);

  ASSERT_EQ(RunJob(db(), "revert", {{"epoch", "1"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), digest);
  EXPECT_EQ(WaitIntegrated(db()).epoch, 5U);
  const JobInfo never = RunJob(db(), "revert", {{"epoch", "77"}});
  EXPECT_EQ(never.state, JobState::kFailed);
  EXPECT_THAT(never.message, HasSubstr("77"));
  ExpectSound();
}

TEST_F(OptimizeTest, ACancelledRunLeavesTheWorld) {
  MakeWorld();
  const std::string digest = Digest();
  const std::vector<Pose> poses = Poses();
  JobInfo last;
  // A job that ends before it can be cancelled is no failure, so there are several tries.
  for (int attempt = 0; attempt < 20 && last.state != JobState::kCancelled; ++attempt) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        last, db().jobs().Start({}, kMapName, "optimize", {{"dry_run", "1"}, {"rounds", "20"}}));
    while (last.state == JobState::kQueued ||
           (last.state == JobState::kRunning && last.progress < 0.1)) {
      STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Get({}, kMapName, last.id));
    }
    STRATA_ASSERT_OK(db().jobs().Cancel({}, kMapName, last.id));
    last = Follow(last.id);
  }
  EXPECT_EQ(last.state, JobState::kCancelled);
  EXPECT_EQ(Digest(), digest);
  ExpectEqual(Poses(), poses);
  EXPECT_EQ(WaitIntegrated(db()).epoch, 1U);
  EXPECT_THAT(Graph().planes, IsEmpty());
  ExpectSound();
}

TEST_F(OptimizeTest, AWatcherIsToldTheScansAndTilesOfTheEpoch) {
  MakeWorld();
  std::map<ScanId, Pose> scans;
  std::map<TileKey, std::uint64_t> tiles;
  std::string reason;
  api::WatchOptions options;
  options.once = true;
  const auto take = [&](const api::MapUpdate& update) {
    options.since = update.commit_sequence;
    options.epoch = update.epoch;
    reason = update.epoch_reason;
    for (const api::ScanChange& scan : update.scans) scans[scan.id] = scan.T_map_scan;
    for (const api::TileChangeNotice& tile : update.tiles) {
      tiles[tile.key] = tile.version;
      if (tile.gone) tiles.erase(tile.key);
    }
    return absl::OkStatus();
  };
  STRATA_ASSERT_OK(db().maps().Watch({}, kMapName, options, take));
  EXPECT_EQ(reason, "");
  const JobInfo job = Optimize();
  ASSERT_EQ(job.state, JobState::kSucceeded);
  scans.clear();
  STRATA_ASSERT_OK(db().maps().Watch({}, kMapName, options, take));
  EXPECT_EQ(options.epoch, 2U);
  EXPECT_THAT(reason, HasSubstr("optimize"));
  EXPECT_EQ(scans.size(), static_cast<std::size_t>(job.metrics.at("scans_moved")));
  for (const auto& [id, T_map_scan] : scans) {
    EXPECT_TRUE(T_map_scan.isApprox(PoseOf(id.sequence), 0.0)) << id.ToString();
  }
  std::map<TileKey, std::uint64_t> listed;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto infos, db().tiles().List({}, kMapName, {}));
  for (const api::TileInfo& info : infos) listed[info.key] = info.version;
  EXPECT_EQ(tiles, listed);
}

TEST_F(OptimizeTest, APriorMovesTheWorldWithoutBendingIt) {
  MakeWorld();
  Constraint gps;
  gps.j = {"run", 2};
  gps.T_i_j = PoseAt(3.0, -2.0) * TruthOf(2);
  gps.information = 1e8 * Matrix6d::Identity();
  STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, gps));
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  EXPECT_LT((PoseOf(2).translation() - gps.T_i_j.translation()).norm(), 0.01);
  EXPECT_LT(Error(), 0.03);
  for (std::uint64_t k = 1; k <= kScans; ++k) {
    const Pose expected = PoseAt(3.0, -2.0) * TruthOf(k);
    EXPECT_LT((PoseOf(k).translation() - expected.translation()).norm(), 0.05) << k;
  }
  ExpectSound();
}

TEST_F(OptimizeTest, WhereGpsAndScansContradictEachOtherAPersonDecides) {
  MakeWorld();
  for (std::uint64_t k = 1; k <= 6; ++k) {
    Constraint gps;
    gps.j = {"run", k};
    const double turn = static_cast<double>(k);
    gps.T_i_j = PoseAt(200.0 * std::cos(turn), 200.0 * std::sin(turn)) * TruthOf(k);
    gps.information = 1e4 * Matrix6d::Identity();
    gps.may_be_false = true;
    STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, gps));
  }
  const Pose before = PoseOf(1);
  const JobInfo job = Optimize();
  EXPECT_EQ(job.state, JobState::kProposed) << job.message;
  EXPECT_THAT(job.message, HasSubstr("of 6 absolute poses do not fit"));
  EXPECT_TRUE(PoseOf(1).isApprox(before, 0.0));
}

TEST_F(OptimizeTest, ADisabledConstraintIsNotUsed) {
  MakeWorld();
  Constraint lie;
  lie.i = {"run", 1};
  lie.j = {"run", 6};
  lie.T_i_j = TruthOf(1).inverse() * TruthOf(6) * PoseAt(0.0, 2.0);
  lie.information = 1e8 * Matrix6d::Identity();
  STRATA_ASSERT_OK_AND_ASSIGN(const Constraint added,
                              db().posegraph().AddConstraint({}, kMapName, lie));
  STRATA_ASSERT_OK(db().posegraph().EnableConstraint({}, kMapName, added.id, false));
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  EXPECT_LT(Error(), 0.03);
  STRATA_ASSERT_OK(db().posegraph().EnableConstraint({}, kMapName, added.id, true));
  ASSERT_EQ(Optimize({{"rounds", "1"}}).state, JobState::kSucceeded);
  EXPECT_GT(Error(), 1.0);
}

TEST_F(OptimizeTest, AConstraintThatMayBeFalseIsRejectedByNameIfItIs) {
  MakeWorld();
  Constraint said;
  said.i = {"run", 1};
  said.j = {"run", 6};
  said.T_i_j = TruthOf(1).inverse() * TruthOf(6);
  said.information = 1e4 * Matrix6d::Identity();
  said.may_be_false = true;
  STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, said));
  said.j.sequence = 5;
  said.T_i_j = TruthOf(1).inverse() * TruthOf(5) * PoseAt(0.0, 2.0, 0.5);
  STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, said));
  const JobInfo job = Optimize({{"closures", "1"}});
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_LT(Error(), 0.03);
  EXPECT_EQ(job.metrics.at("constraints_rejected"), 1.0);
  ASSERT_TRUE(job.metrics.contains("rejected.run/1.run/5"));
  EXPECT_GT(job.metrics.at("rejected.run/1.run/5"), 1000.0);
  EXPECT_FALSE(job.metrics.contains("rejected.run/1.run/6"));
  // Without robust estimation it is believed.
  const JobInfo naive = Optimize({{"robust", "0"}, {"rounds", "1"}});
  ASSERT_EQ(naive.state, JobState::kSucceeded) << naive.message;
  EXPECT_EQ(naive.metrics.at("constraints_rejected"), 0.0);
  EXPECT_GT(Error(), 0.1);
}

TEST_F(OptimizeTest, ADisabledPlaneIsNotUsedButRemembered) {
  MakeWorld();
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  const std::vector<GlobalPlane> planes = Graph().planes;
  ASSERT_THAT(planes, Not(IsEmpty()));
  const GlobalPlane floor = *std::max_element(
      planes.begin(), planes.end(), [](const GlobalPlane& a, const GlobalPlane& b) {
        return a.supports.size() < b.supports.size();
      });
  const auto same = [&floor](const GlobalPlane& plane) {
    return plane.enabled && plane.plane.normal.dot(floor.plane.normal) > 0.9995 &&
           std::abs(plane.plane.distance - floor.plane.distance) < 0.05;
  };
  ASSERT_TRUE(same(floor));
  STRATA_ASSERT_OK(db().posegraph().EnableConstraint({}, kMapName, floor.id, false));
  for (int run = 0; run < 2; ++run) {
    ASSERT_EQ(Optimize().state, JobState::kSucceeded);
    const std::vector<GlobalPlane> now = Graph().planes;
    EXPECT_EQ(std::count_if(now.begin(), now.end(), same), 0);
    const auto disabled = std::count_if(
        now.begin(), now.end(), [](const GlobalPlane& plane) { return !plane.enabled; });
    EXPECT_EQ(disabled, 1);
  }
  EXPECT_EQ(Optimize({{"planes", "0"}}).metrics.at("planes"), 0.0);
}

// What the job had found brought it back, and the next job used it.
TEST_F(OptimizeTest, APlaneThatIsDisabledBeforeAProposalIsAcceptedStaysSo) {
  MakeWorld();
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  const JobInfo job = Optimize({{"dry_run", "1"}});
  const std::vector<GlobalPlane> planes = Graph().planes;
  ASSERT_THAT(planes, Not(IsEmpty()));
  const GlobalPlane floor = *std::ranges::max_element(
      planes, {}, [](const GlobalPlane& plane) { return plane.supports.size(); });
  STRATA_ASSERT_OK(db().posegraph().EnableConstraint({}, kMapName, floor.id, false));
  STRATA_ASSERT_OK(db().jobs().Accept({}, kMapName, job.id));
  ASSERT_EQ(Follow(job.id).state, JobState::kSucceeded);
  std::vector<GlobalPlane> off = Graph().planes;
  std::erase_if(off, [](const GlobalPlane& plane) { return plane.enabled; });
  ASSERT_EQ(off.size(), 1U);
  EXPECT_GT(off[0].plane.normal.dot(floor.plane.normal), 0.9995);
  EXPECT_NEAR(off[0].plane.distance, floor.plane.distance, 0.05);
  EXPECT_EQ(off[0].supports.size(), floor.supports.size());
}

// A robot may upload in the frame of its base. Taken for seen from the floor itself, some scans saw
// the floor from below, and it became two planes.
TEST_F(OptimizeTest, PlanesAreSeenFromTheSensorWhereverTheFrameIs) {
  MakeMap(MapParameters());
  const Eigen::Vector3f sensor(0.0F, 0.0F, 1.2F);
  for (std::uint64_t k = 1; k <= kScans; ++k) {
    PointCloud cloud = See(TruthOf(k), k);
    for (Eigen::Vector3f& p : cloud.points) p += sensor;
    Pose said = SaidOf(k);
    said.translation().z() = 0.0;
    ScanHeader header = HeaderOf({"run", k}, cloud, said);
    header.sensor_origin = sensor;
    STRATA_ASSERT_OK(Upload(db(), header, cloud, 6000));
  }
  WaitIntegrated(db());
  ASSERT_EQ(Optimize().state, JobState::kSucceeded);
  int floors = 0;
  for (const GlobalPlane& plane : Graph().planes) {
    EXPECT_GT(plane.plane.normal.z(), -0.9) << "seen from below at " << plane.plane.distance;
    floors += plane.plane.normal.z() > 0.99 && std::abs(plane.plane.distance) < 0.05 ? 1 : 0;
  }
  EXPECT_EQ(floors, 1);
}

// Root of the mean squared distance from the truth, best aligned [m].
double Ate(const std::vector<Pose>& poses, const std::vector<Pose>& truth) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd is(3, count);
  Eigen::Matrix3Xd should(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    is.col(k) = poses[static_cast<std::size_t>(k)].translation();
    should.col(k) = truth[static_cast<std::size_t>(k)].translation();
  }
  const Pose T(Eigen::umeyama(is, should, false));
  return std::sqrt((T * is - should).squaredNorm() / static_cast<double>(count));
}

// Where surfaces hold nothing the robot's own word stands. Once thousands of points of the floor
// dragged the scans together: 1.1 m off instead of 0.1 m.
TEST_F(OptimizeTest, AFloorWithHardlyAnythingOnItDoesNotSlide) {
  constexpr std::uint64_t kSeed = 1;
  constexpr int kSteps = 24;
  std::vector<Pose> truth;
  for (int k = 0; k < kSteps; ++k) {
    const double a = 2.2 * M_PI * k / kSteps;
    truth.push_back(PoseAt(10.0 * std::cos(a), 10.0 * std::sin(a), a + M_PI_2));
  }
  const std::vector<Pose> odometry = NoisyOdometry(truth, {}, kSeed);
  const double uploaded = Ate(odometry, truth);
  for (const Alignment alignment : {Alignment::kOff, Alignment::kOn}) {
    const std::string map = alignment == Alignment::kOn ? "aligned" : "as_uploaded";
    SCOPED_TRACE(map);
    MakeMap(MapParameters(), map);
    for (std::uint64_t k = 0; k < kSteps; ++k) {
      const PointCloud cloud = SeeFloor(truth[k], 1000 * kSeed + k);
      STRATA_ASSERT_OK(
          Upload(db(), HeaderOf({"run", k + 1}, cloud, odometry[k], alignment), cloud, 6000, map));
    }
    WaitIntegrated(db(), map);
    const auto error = [&] {
      std::vector<Pose> poses;
      const absl::StatusOr<api::PoseGraphState> graph = db().posegraph().Get({}, map);
      EXPECT_THAT(graph, IsOk());
      if (graph.ok()) {
        for (const PoseNode& node : graph->nodes) poses.push_back(node.T_map_scan);
      }
      return Ate(poses, truth);
    };
    EXPECT_LE(error(), 1.1 * uploaded);
    const JobInfo job = RunJob(db(), "optimize", {}, map);
    ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
    EXPECT_LE(error(), 1.1 * uploaded);
    RecordProperty("error_mm_" + map, static_cast<int>(1000 * error()));
  }
}

TEST_F(OptimizeTest, AnEmptyMapIsConsistent) {
  MakeMap(MapParameters());
  const JobInfo job = RunJob(db(), "optimize");
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(WaitIntegrated(db()).epoch, 1U);
}

}  // namespace
}  // namespace strata::testing
