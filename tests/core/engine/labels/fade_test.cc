// The job "fade": what has gone leaves the map, and can come back.
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/see_through.h"
#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kScans = 14;
constexpr std::uint64_t kWithCrate = 4;  // scans before it was taken away

Scene Yard(bool crate) {
  Scene scene;
  scene.SetTerrain(Eigen::AlignedBox2d(Eigen::Vector2d(-15.0, -15.0), Eigen::Vector2d(15.0, 15.0)),
                   1.0,
                   [](double, double) { return 0.0; });
  scene.Add(Box({-10.0, 8.0, 0.0}, {10.0, 8.2, 2.0}));
  if (crate) scene.Add(Box({0.0, 3.0, 0.0}, {1.5, 4.5, 1.2}));
  scene.Build();
  return scene;
}

Pose StopAt(std::uint64_t i) {
  Pose T = Pose::Identity();
  T.translate(Eigen::Vector3d(-4.0 + 0.7 * static_cast<double>(i), 0.0, 2.2));
  return T;
}

PointCloud Seen(std::uint64_t i) {
  SensorOptions sensor;
  sensor.rings = 128;
  sensor.columns = 720;
  return SimulateScan(Yard(i < kWithCrate), sensor, StopAt(i), i);
}

const PointCloud& ScanAt(std::uint64_t i) {
  static std::map<std::uint64_t, PointCloud>* const scans = new std::map<std::uint64_t, PointCloud>;
  const auto it = scans->find(i);
  return it != scans->end() ? it->second : scans->emplace(i, Seen(i)).first->second;
}

// Surfaces higher than the ground where the crate was.
std::size_t SurfacesOfCrate(api::Database& db) {
  std::vector<Eigen::Vector2d> places;
  for (double x = 0.05; x < 1.5; x += 0.1) {
    for (double y = 3.05; y < 4.5; y += 0.1) places.emplace_back(x, y);
  }
  std::size_t high = 0;
  const auto columns = db.planning().SampleSurfaces({}, kMapName, places);
  EXPECT_THAT(columns, IsOk());
  if (!columns.ok()) return high;
  for (const SurfaceColumn& column : *columns) {
    for (const Surface& surface : column.surfaces) high += surface.z_m > 0.3F ? 1 : 0;
  }
  return high;
}

// A map of all scans, made once: every test has a copy of its file.
class FadeTest : public EngineTest {
 protected:
  static void SetUpTestSuite() { kept_ = new TempDir; }
  static void TearDownTestSuite() {
    delete kept_;
    kept_ = nullptr;
  }
  void SetUp() override {
    const std::filesystem::path kept = kept_->path() / "map";
    if (std::filesystem::exists(kept)) {
      std::filesystem::copy_file(kept, MapFile(kMapName));
      return Reopen();
    }
    MakeMap(MapParameters());
    for (std::uint64_t i = 0; i < kScans; ++i) {
      const PointCloud cloud = ScanAt(i);
      ASSERT_THAT(Upload(db(), HeaderOf({"robot", i}, cloud, StopAt(i)), cloud), IsOk());
    }
    ASSERT_EQ(WaitIntegrated(db()).scans, kScans);
    Close();
    std::filesystem::copy_file(MapFile(kMapName), kept);
    Reopen();
  }
  std::vector<std::uint16_t> FadedOf(std::uint64_t i) {
    return db().scans().GetFaded({}, kMapName, {"robot", i}).value();
  }

 private:
  static inline TempDir* kept_ = nullptr;
};

TEST_F(FadeTest, WhatHasGoneLeavesTheMapAndComesBack) {
  const std::string before = Digest();
  const std::size_t high = SurfacesOfCrate(db());
  EXPECT_GT(high, 40U);
  const JobInfo job = RunJob(db(), "fade");
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_GT(job.metrics.at("points_faded"), 500.0);
  EXPECT_LT(SurfacesOfCrate(db()), high / 4);
  ExpectSound();

  const std::string faded = Digest();
  EXPECT_NE(faded, before);
  EXPECT_EQ(RunJob(db(), "fade").metrics.at("scans_changed"), 0.0);
  EXPECT_EQ(RunJob(db(), "fade", {{"undo", "1"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), before);
  ExpectSound();
}

// The map is that of the scans without the points that have faded.
TEST_F(FadeTest, TheMapIsThatOfWhatLasts) {
  ASSERT_EQ(RunJob(db(), "fade").state, JobState::kSucceeded);
  MakeMap(MapParameters(), "lasting");
  for (std::uint64_t i = 0; i < kScans; ++i) {
    PointCloud cloud = ScanAt(i);
    const std::vector<std::uint16_t> faded = FadedOf(i);
    const ScanInfo info = db().scans().Get({}, kMapName, {"robot", i}).value();
    std::vector<Eigen::Vector3f> points;
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      if (faded.empty() || faded[k] == 0) points.push_back(cloud.points[k]);
    }
    EXPECT_EQ(info.faded_points, cloud.size() - points.size());
    if (i >= kWithCrate) {
      EXPECT_EQ(info.faded_points, 0U) << i;
    }
    cloud.points = points;
    ASSERT_THAT(Upload(db(), HeaderOf({"robot", i}, cloud, StopAt(i)), cloud, 2000, "lasting"),
                IsOk());
  }
  EXPECT_EQ(WaitIntegrated(db(), "lasting").content_digest, Digest());
}

TEST_F(FadeTest, EvidenceLastsARestartAMoveAndARebuild) {
  ASSERT_EQ(RunJob(db(), "fade").state, JobState::kSucceeded);
  const std::string faded = Digest();
  const std::vector<std::uint16_t> evidence = FadedOf(1);
  EXPECT_THAT(evidence, ::testing::Contains(::testing::Ge(3)));
  Reopen();
  EXPECT_EQ(Digest(), faded);
  EXPECT_EQ(FadedOf(1), evidence);
  ASSERT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), faded);
  // There and back: what has faded stays away.
  ASSERT_THAT(db().posegraph().SetPose({}, kMapName, {"robot", 1}, PoseAt(0.0, -3.0)), IsOk());
  EXPECT_NE(Digest(), faded);
  ASSERT_THAT(db().posegraph().SetPose({}, kMapName, {"robot", 1}, StopAt(1)), IsOk());
  EXPECT_EQ(Digest(), faded);
  ExpectSound();
}

TEST_F(FadeTest, AnyNumberOfThreadsTellsTheSame) {
  ASSERT_EQ(RunJob(db(), "fade", {{"threads", "1"}}).state, JobState::kSucceeded);
  const std::string one = Digest();
  ASSERT_EQ(RunJob(db(), "fade", {{"undo", "1"}}).state, JobState::kSucceeded);
  ASSERT_EQ(RunJob(db(), "fade", {{"threads", "4"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), one);
}

TEST_F(FadeTest, DamagedEvidenceIsNamed) {
  ASSERT_EQ(RunJob(db(), "fade").state, JobState::kSucceeded);
  Close();
  Sql("UPDATE truth_label SET bytes = x'00' WHERE origin = 3 AND scan = (SELECT min(scan) FROM "
      "truth_label WHERE origin = 3)");
  Reopen();
  const JobInfo verify = RunJob(db(), "verify");
  EXPECT_EQ(verify.state, JobState::kFailed);
  EXPECT_THAT(verify.message, ::testing::HasSubstr("robot/"));
  // Undone, nothing of it is left to be damaged.
  EXPECT_EQ(RunJob(db(), "fade", {{"undo", "1"}}).state, JobState::kSucceeded);
  ExpectSound();
}

// A wall, and before it, above the ground, a thing that only the first scan saw: nothing of that
// scan lasts.
TEST_F(EngineTest, AScanOfWhichNothingIsLeftMayBeMoved) {
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.2;
  MakeMap(parameters);
  const auto upright = [](float x, float half, float step) {
    PointCloud cloud;
    const int count = static_cast<int>(half / step);
    for (int y = -count; y <= count; ++y) {
      for (int z = -count; z <= count; ++z) {
        cloud.points.emplace_back(x, step * static_cast<float>(y), step * static_cast<float>(z));
      }
    }
    return cloud;
  };
  const ScanId thing{"thing", 1};
  const PointCloud seen = upright(4.0F, 0.1F, 0.05F);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf(thing, seen, PoseAt(0, 0)), seen));
  PointCloud wall = upright(8.0F, 2.0F, 0.02F);
  for (float x = 3.0F; x < 5.0F; x += 0.05F) {
    for (float y = -0.5F; y < 0.5F; y += 0.05F) wall.points.emplace_back(x, y, -0.9F);
  }
  for (std::uint64_t i = 1; i <= 4; ++i) {
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"wall", i}, wall, PoseAt(0, 0)), wall));
  }
  WaitIntegrated(db());
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, thing, PoseAt(0.05, 0.0)));
  const std::string before = Digest();
  EXPECT_EQ(RunJob(db(), "fade", {{"scans", "2"}, {"rays", "1"}}).state, JobState::kSucceeded);
  ASSERT_EQ(db().scans().Get({}, kMapName, thing)->faded_points, seen.size());

  STRATA_EXPECT_OK(db().posegraph().SetPose({}, kMapName, thing, PoseAt(0.1, 0.0)));
  ExpectSound();
  for (const ScanId& id : {thing, ScanId{"wall", 1}}) {
    Constraint prior;
    prior.j = id;
    prior.T_i_j = PoseAt(3.0, 0.0);
    prior.information *= 1e4;
    STRATA_ASSERT_OK(db().posegraph().AddConstraint({}, kMapName, prior));
  }
  const JobInfo optimized = RunJob(db(), "optimize");
  EXPECT_EQ(optimized.state, JobState::kSucceeded) << optimized.message;
  ExpectSound();
  const JobInfo reverted = RunJob(db(), "revert", {{"epoch", "2"}});
  EXPECT_EQ(reverted.state, JobState::kSucceeded) << reverted.message;
  ExpectSound();
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  EXPECT_EQ(RunJob(db(), "fade", {{"undo", "1"}}).state, JobState::kSucceeded);
  EXPECT_EQ(Digest(), before);
}

TEST_F(FadeTest, ACancelledJobChangesNothing) {
  const std::string before = Digest();
  const auto tiles = AllTiles(db());
  int cancelled = 0;
  for (const double enough : {0.0, 0.2, 0.6, 0.7, 0.8, 0.9, 0.95}) {
    const JobInfo job = db().jobs().Start({}, kMapName, "fade", {}).value();
    JobInfo last;
    const auto cancel_when_there = [&](const JobInfo& now) -> absl::Status {
      last = now;
      if (now.progress < enough) return absl::OkStatus();
      return db().jobs().Cancel({}, kMapName, job.id).status();
    };
    ASSERT_THAT(db().jobs().Watch({}, kMapName, job.id, cancel_when_there), IsOk());
    if (last.state != JobState::kCancelled) {  // it was quicker
      ASSERT_EQ(RunJob(db(), "fade", {{"undo", "1"}}).state, JobState::kSucceeded);
      continue;
    }
    ++cancelled;
    EXPECT_EQ(Digest(), before) << enough;
    EXPECT_TRUE(AllTiles(db()) == tiles) << enough;
    for (std::uint64_t i = 0; i < kScans; ++i) {
      EXPECT_EQ(db().scans().Get({}, kMapName, {"robot", i})->faded_points, 0U) << i;
    }
  }
  EXPECT_GT(cancelled, 0);
  ExpectSound();
}

TEST_F(FadeTest, AScanThatIsDeletedMeanwhileIsLeftOut) {
  const JobInfo job = db().jobs().Start({}, kMapName, "fade", {}).value();
  ASSERT_THAT(db().scans().Delete({}, kMapName, {"robot", 0}), IsOk());
  JobInfo last;
  ASSERT_THAT(db().jobs().Watch({},
                                kMapName,
                                job.id,
                                [&](const JobInfo& now) -> absl::Status {
                                  last = now;
                                  // Not before the first points were read.
                                  if (now.progress == 0.0) return absl::OkStatus();
                                  db().scans().Delete({}, kMapName, {"robot", 1}).IgnoreError();
                                  return absl::OkStatus();
                                }),
              IsOk());
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  ExpectSound();
}

// Points beyond the sensor's range are no part of the map, wherever they are; and those within it
// may be far from each other.
TEST_F(EngineTest, AFewPointsFarAwayDoNotHoldTheJobUp) {
  MakeMap(MapParameters());
  for (std::uint64_t i = 0; i < 4; ++i) {
    PointCloud cloud = MakeRoom(i);
    cloud.points.emplace_back(-5e5F, -5e5F, 0.0F);
    cloud.points.emplace_back(5e5F, 5e5F, 0.0F);
    ScanHeader header = HeaderOf({"stray", i}, cloud, RoomPose(0));
    if (i % 2 == 1) header.sensor = SensorModel{.max_range_m = 1e6};
    ASSERT_THAT(Upload(db(), header, cloud), IsOk());
  }
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 0U);
  const JobInfo job = RunJob(db(), "fade", {{"scans", "1"}, {"rays", "1"}});
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  ExpectSound();
}

TEST_F(EngineTest, AMapThatLetsThingsFadeDoesSoByItself) {
  EngineOptions options = Options();
  options.optimize_interval = absl::Milliseconds(10);
  Reopen(options);
  MapParameters parameters;
  parameters.fade_after = 3;
  MakeMap(parameters);
  for (std::uint64_t i = 0; i < kScans; ++i) {
    const PointCloud cloud = ScanAt(i);
    ASSERT_THAT(Upload(db(), HeaderOf({"robot", i}, cloud, StopAt(i)), cloud), IsOk());
  }
  std::vector<JobInfo> fades;
  const absl::Time deadline = absl::Now() + kPatience;
  while (absl::Now() < deadline && (fades.empty() || !IsFinal(fades[0].state))) {
    absl::SleepFor(absl::Milliseconds(10));
    fades = db().jobs().List({}, kMapName).value();
    std::erase_if(fades, [](const JobInfo& job) { return job.kind != "fade"; });
  }
  ASSERT_FALSE(fades.empty());
  EXPECT_EQ(fades[0].state, JobState::kSucceeded) << fades[0].message;
  EXPECT_GE(fades[0].metrics.at("scans"), 10.0);
}

TEST(FadeArgumentsTest, WhatNobodySaysIsAsTheLibraryHasIt) {
  const SeeThroughOptions library;
  STRATA_ASSERT_OK_AND_ASSIGN(const JobArguments arguments, ReadJobArguments(kFadeJob, {}));
  EXPECT_EQ(arguments.Whole("rays"), library.rays);
  EXPECT_EQ(arguments.Real("clearance_m"), library.clearance_m);
  EXPECT_THAT(std::string(JobParameterOf(kFadeJob, "scans").help),
              ::testing::HasSubstr(absl::StrCat("or ", library.scans)));
}

TEST_F(EngineTest, MapsThatDropPointsDoNotFade) {
  MapParameters parameters = SmallMap();
  parameters.keep_points = false;
  MakeMap(parameters);
  EXPECT_THAT(db().jobs().Start({}, kMapName, "fade", {}).status(),
              StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::_));
  parameters.fade_after = 3;
  EXPECT_THAT(db().maps().Create({}, "other", parameters).status(),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::_));
  EXPECT_THAT(db().jobs().Start({}, kMapName, "fade", {{"scans", "0"}}).status(),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::_));
}

}  // namespace
}  // namespace strata::testing
