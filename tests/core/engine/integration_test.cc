// What becomes of scans: tiles, poses, epochs, jobs.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Changes a map file behind the engine's back.
void Sql(const std::filesystem::path& file, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &db), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
  sqlite3_close(db);
}

class IntegrationTest : public EngineTest {
 protected:
  void UploadRooms(int count) {
    for (int i = 1; i <= count; ++i) {
      UploadRoom(static_cast<std::uint64_t>(i), PoseAt(4.0 * i - 10.0, 0.7 * i, 0.3 * i));
    }
  }
  std::string Digest() { return WaitIntegrated(db()).content_digest; }
};

TEST_F(IntegrationTest, TilesDoNotDependOnOrderBatchesOrThreads) {
  MakeMap();
  UploadRooms(7);
  const MapStats forward = WaitIntegrated(db());
  EXPECT_EQ(forward.scans, 7U);
  EXPECT_EQ(forward.scans_failed, 0U);
  EXPECT_GT(forward.patches, 5000U);
  EXPECT_GT(forward.tiles, 3U);
  const auto tiles = AllTiles(db());
  Close();

  EngineOptions options = Options();
  options.max_batch_scans = 1;
  options.worker_threads = 4;
  Reopen(options);
  MakeMap(SmallMap(), "other");
  for (int i = 7; i >= 1; --i) {
    const PointCloud cloud = MakeRoom(static_cast<std::uint64_t>(i));
    STRATA_ASSERT_OK(Upload(db(),
                            HeaderOf({"run", static_cast<std::uint64_t>(i)},
                                     cloud,
                                     PoseAt(4.0 * i - 10.0, 0.7 * i, 0.3 * i)),
                            cloud,
                            1000,
                            "other"));
  }
  EXPECT_EQ(WaitIntegrated(db(), "other").content_digest, forward.content_digest);
  const auto other = AllTiles(db(), "other");
  ASSERT_EQ(other.size(), tiles.size());
  for (const auto& [key, bytes] : tiles) {
    const SurfaceTile a = DecodeSurfaceTile(bytes).value();
    const SurfaceTile b = DecodeSurfaceTile(other.at(key)).value();
    EXPECT_EQ(a.surfaces, b.surfaces) << key.ToString();
  }
}

TEST_F(IntegrationTest, RestartContinuesWithPendingScans) {
  MakeMap();
  UploadRooms(12);
  Close();  // some are surely still pending
  Reopen();
  const MapStats stats = WaitIntegrated(db());
  EXPECT_EQ(stats.scans, 12U);
  MakeMap(SmallMap(), "other");
  for (int i = 1; i <= 12; ++i) {
    const PointCloud cloud = MakeRoom(static_cast<std::uint64_t>(i));
    STRATA_ASSERT_OK(Upload(db(),
                            HeaderOf({"run", static_cast<std::uint64_t>(i)},
                                     cloud,
                                     PoseAt(4.0 * i - 10.0, 0.7 * i, 0.3 * i)),
                            cloud,
                            1000,
                            "other"));
  }
  EXPECT_EQ(WaitIntegrated(db(), "other").content_digest, stats.content_digest);
}

TEST_F(IntegrationTest, ScansAreAlignedToThoseAround) {
  MapParameters parameters = SmallMap();
  parameters.mls.cell_size_m = 0.2;
  MakeMap(parameters);
  double uploaded_error = 0.0;
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Pose truth = PoseAt(1.5 * static_cast<double>(i), 0.0, 0.05 * static_cast<double>(i));
    const PointCloud cloud = SeeWorld(truth, i + 1, 60'000);
    const Pose rough = i == 0 ? truth : truth * PoseAt(0.15, -0.1, 0.01);
    uploaded_error = (rough.translation() - truth.translation()).norm();
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", i}, cloud, rough, Alignment::kOn), cloud));
  }
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo last, db().scans().Get({}, kMapName, {"run", 5}));
  EXPECT_TRUE(last.alignment.aligned) << last.alignment.message;
  const Pose truth = PoseAt(7.5, 0.0, 0.25);
  EXPECT_LT((last.T_map_scan.translation() - truth.translation()).norm(), uploaded_error / 2);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  EXPECT_EQ(graph.nodes.size(), 6U);
  ASSERT_GE(graph.constraints.size(), 5U);
  for (const Constraint& constraint : graph.constraints) {
    EXPECT_GT(constraint.information.diagonal().minCoeff(), 0.0);
  }
}

TEST_F(IntegrationTest, DeleteEqualsNeverUploaded) {
  MakeMap();
  UploadRooms(3);
  const std::string before = Digest();
  const auto tiles = AllTiles(db());
  UploadRoom(9, PoseAt(1, 1));
  EXPECT_THAT(Digest(), Not(before));
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 9}));
  EXPECT_EQ(Digest(), before);
  for (const auto& [key, bytes] : AllTiles(db())) {
    ASSERT_TRUE(tiles.contains(key)) << key.ToString();
    EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(tiles.at(key))->surfaces);
  }
  EXPECT_THAT(db().scans().Delete({}, kMapName, {"run", 9}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("run/9")));
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
}

TEST_F(IntegrationTest, SetPoseEqualsHavingBeenThereAndBeginsAnEpoch) {
  MakeMap();
  UploadRooms(3);
  const MapStats before = WaitIntegrated(db());
  const Pose T_map_scan = PoseAt(30, -5, 1.0);
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, T_map_scan));
  const MapStats after = WaitIntegrated(db());
  EXPECT_EQ(after.epoch, before.epoch + 1);
  EXPECT_NE(after.content_digest, before.content_digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo moved, db().scans().Get({}, kMapName, {"run", 2}));
  EXPECT_TRUE(moved.T_map_scan.isApprox(T_map_scan, 0.0));
  EXPECT_TRUE(moved.header.T_map_scan.isApprox(PoseAt(-2.0, 1.4, 0.6)));
  const JobInfo verified = RunJob(db(), "verify");
  EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;

  const PointCloud room = MakeRoom(2);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 2}, room, T_map_scan), room));
  EXPECT_EQ(Digest(), after.content_digest);
}

TEST_F(IntegrationTest, RebuildOfASoundMapChangesNothingForAnyThreads) {
  MakeMap();
  UploadRooms(5);
  const MapStats before = WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (const char* threads : {"1", "4"}) {
    const JobInfo job = RunJob(db(), "rebuild", {{"threads", threads}});
    ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
    EXPECT_EQ(job.metrics.at("tiles_changed"), 0.0);
    EXPECT_EQ(Digest(), before.content_digest);
    EXPECT_EQ(AllTiles(db()), tiles);
  }
}

TEST_F(IntegrationTest, DroppedDerivedDataComeBackByThemselves) {
  MakeMap();
  UploadRooms(5);
  const MapStats before = WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (int threads : {1, 4}) {
    Close();
    Sql(MapFile(),
        "DROP TABLE derived_mls_tile; DROP TABLE derived_surface_tile; DROP TABLE "
        "derived_scan_tile; DROP TABLE derived_footprint; DROP TABLE derived_state;");
    EngineOptions options = Options();
    options.worker_threads = threads;
    Reopen(options);
    // Jobs run after the recovery.
    EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
    EXPECT_EQ(Digest(), before.content_digest);
    const auto again = AllTiles(db());
    ASSERT_EQ(again.size(), tiles.size());
    for (const auto& [key, bytes] : tiles) {
      EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(again.at(key))->surfaces);
    }
  }
}

TEST_F(IntegrationTest, DamagedTileIsDataLossVerifyNamesItAndRebuildMendsIt) {
  MakeMap();
  UploadRooms(3);
  WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (const std::string table : {"derived_surface_tile", "derived_mls_tile"}) {
    Close();
    Sql(MapFile(),
        "UPDATE " + table +
            " SET bytes = CAST(substr(bytes, 1, 40) || x'5a5a' || substr(bytes, 43) AS BLOB) "
            "WHERE level = 0 AND (x, y) = (SELECT x, y FROM " +
            table + " WHERE level = 0 ORDER BY x, y LIMIT 1)");
    Reopen();
    const TileKey key = tiles.begin()->first;
    if (table == "derived_surface_tile") {
      EXPECT_THAT(db().tiles().Get({}, kMapName, key),
                  StatusIs(absl::StatusCode::kDataLoss, HasSubstr(key.ToString())));
      EXPECT_THAT(db().tiles().Get({}, kMapName, std::next(tiles.begin())->first), IsOk());
    }
    const JobInfo found = RunJob(db(), "verify");
    EXPECT_EQ(found.state, JobState::kFailed);
    EXPECT_THAT(found.message, HasSubstr("tile " + key.ToString()));
    EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
    const JobInfo mended = RunJob(db(), "verify");
    EXPECT_EQ(mended.state, JobState::kSucceeded) << mended.message;
    EXPECT_THAT(db().tiles().Get({}, kMapName, key), IsOk());
  }
}

TEST_F(IntegrationTest, DamagedPointsAreNamed) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  Close();
  Sql(MapFile(),
      "UPDATE truth_chunk SET bytes = CAST(substr(bytes, 1, 100) || x'00ff' || substr(bytes, 103) "
      "AS BLOB) WHERE upload = (SELECT upload FROM truth_scan WHERE sequence = 2)");
  Reopen();
  const JobInfo job = RunJob(db(), "verify");
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("scan run/2"));
  EXPECT_THAT(db().scans().GetPoints(
                  {}, kMapName, {"run", 2}, [](const PointCloud&) { return absl::OkStatus(); }),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("run/2")));
}

TEST_F(IntegrationTest, FetchSendsOnlyWhatChangedOrIsGone) {
  MakeMap();
  UploadRoom(1, PoseAt(0, 0));
  UploadRoom(2, PoseAt(200, 0));
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto infos, db().tiles().List({}, kMapName, {}));
  std::vector<api::HeldTile> held;
  for (const api::TileInfo& info : infos) held.push_back({info.key, info.version});
  const auto fetch = [&] {
    std::map<TileKey, api::TileUpdate::Kind> kinds;
    STRATA_EXPECT_OK(db().tiles().Fetch({}, kMapName, {}, held, [&](const api::TileUpdate& u) {
      kinds[u.tile.key] = u.kind;
      return absl::OkStatus();
    }));
    return kinds;
  };
  EXPECT_TRUE(fetch().empty());
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  const auto kinds = fetch();
  EXPECT_FALSE(kinds.empty());
  for (const auto& [key, kind] : kinds) {
    EXPECT_EQ(kind, api::TileUpdate::Kind::kGone) << key.ToString();
    EXPECT_GT(key.x, 5);
  }
}

TEST_F(IntegrationTest, AStreamKeepsToTheStateItBeganWith) {
  MakeMap();
  UploadRooms(4);
  WaitIntegrated(db());
  const auto before = AllTiles(db());
  std::map<TileKey, std::string> streamed;
  bool moved = false;
  STRATA_ASSERT_OK(db().tiles().Fetch({}, kMapName, {}, {}, [&](const api::TileUpdate& update) {
    streamed[update.tile.key] = update.tile.bytes;
    if (!moved) {
      moved = true;
      STRATA_EXPECT_OK(db().posegraph().SetPose({}, kMapName, {"run", 4}, PoseAt(60, 60)));
      STRATA_EXPECT_OK(db().scans().Delete({}, kMapName, {"run", 1}));
    }
    return absl::OkStatus();
  }));
  for (const auto& [key, bytes] : streamed) EXPECT_EQ(bytes, before.at(key)) << key.ToString();
  EXPECT_EQ(streamed.size(), std::count_if(before.begin(), before.end(), [](const auto& tile) {
              return tile.first.level == 0;
            }));
}

TEST_F(IntegrationTest, MapWithoutPointsKeepsItsContent) {
  MapParameters parameters = SmallMap();
  parameters.keep_points = false;
  MakeMap(parameters);
  UploadRooms(3);
  const MapStats before = WaitIntegrated(db());
  EXPECT_EQ(before.point_bytes, 0U);
  EXPECT_EQ(before.points, 9000U);
  EXPECT_THAT(db().scans().GetPoints(
                  {}, kMapName, {"run", 2}, [](const PointCloud&) { return absl::OkStatus(); }),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("run/2")));
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
  const PointCloud room = MakeRoom(2);
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ScanAck ack, Upload(db(), HeaderOf({"run", 2}, room, PoseAt(-2.0, 1.4, 0.6)), room));
  EXPECT_TRUE(ack.already_present);
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(3, 3, 3)));
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(-2.0, 1.4, 0.6)));
  EXPECT_EQ(Digest(), before.content_digest);
}

TEST_F(IntegrationTest, ProfileChangeIsReversibleAndRaisesOnlyChangedVersions) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  const auto before = AllTiles(db());
  RobotProfile climber;
  climber.max_step_m = 5.0;
  climber.max_slope_rad = 1.5;
  climber.max_roughness_m = 10.0;
  STRATA_ASSERT_OK(db().planning().SetProfile({}, kMapName, api::kDefaultProfile, climber));
  EXPECT_NE(AllTiles(db()), before);
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
  STRATA_ASSERT_OK(db().planning().SetProfile({}, kMapName, api::kDefaultProfile, {}));
  const auto after = AllTiles(db());
  for (const auto& [key, bytes] : before) {
    EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(after.at(key))->surfaces);
  }
}

TEST_F(IntegrationTest, PlansAndSamplesOnTheTiles) {
  MakeMap();
  const PointCloud cloud = SeeWorld(PoseAt(0, 0), 1, 300'000);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(0, 0)), cloud, 40'000));
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto columns,
      db().planning().SampleSurfaces(
          {}, kMapName, {{cloud.points[0].x(), cloud.points[0].y()}, {1e4, 0}}));
  ASSERT_EQ(columns.size(), 2U);
  EXPECT_FALSE(columns[0].surfaces.empty());
  EXPECT_TRUE(columns[1].surfaces.empty());
  PlanQuery query;
  query.from = {.x_m = 1e4, .y_m = 0.0};
  query.to = {.x_m = 0.0, .y_m = 0.0};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult none, db().planning().PlanPath({}, kMapName, query));
  EXPECT_EQ(none.reason, PlanReason::kStartNotOnSurface);
  EXPECT_EQ(none.epoch, 1U);
}

TEST_F(IntegrationTest, ManyRobotsAtOnce) {
  MakeMap();
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([this, robot] {
      for (std::uint64_t i = 1; i <= 6; ++i) {
        const PointCloud cloud = MakeRoom(i + 100 * static_cast<std::uint64_t>(robot), 1000);
        const ScanId id{"robot" + std::to_string(robot), i};
        STRATA_EXPECT_OK(Upload(db(), HeaderOf(id, cloud, PoseAt(robot * 5.0, i * 3.0)), cloud));
        STRATA_EXPECT_OK(db().maps().Stats({}, kMapName));
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(WaitIntegrated(db()).scans, 24U);
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
}

TEST_F(IntegrationTest, JobsAreCheckedListedAndSurvive) {
  MakeMap();
  EXPECT_THAT(db().jobs().Start({}, kMapName, "dance", {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("dance")));
  EXPECT_THAT(db().jobs().Start({}, kMapName, "verify", {{"threads", "0"}}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("threads")));
  const JobInfo first = RunJob(db(), "verify");
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo second, db().jobs().Start({}, kMapName, "rebuild", {}));
  Reopen();
  STRATA_EXPECT_OK(
      db().jobs().Watch({}, kMapName, second.id, [](const JobInfo&) { return absl::OkStatus(); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> all, db().jobs().List({}, kMapName));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].metrics, first.metrics);
  EXPECT_EQ(all[1].state, JobState::kSucceeded);
  EXPECT_THAT(db().jobs().Get({}, kMapName, 99),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("99")));
}

TEST_F(IntegrationTest, AScanThatLeavesTheMapIsNotLostInSilence) {
  MakeMap();
  Pose high = Pose::Identity();
  high.translation().z() = 3000.0;
  const auto beyond = HasSubstr("0 of 3000 points within what a map can hold");
  const ScanId lost = UploadRoom(1, high);
  const ScanId room = UploadRoom(2, PoseAt(0, 0));
  const std::string digest = Digest();
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMapName, lost));
  EXPECT_EQ(scan.state, ScanState::kFailed);
  EXPECT_THAT(scan.message, beyond);
  EXPECT_THAT(db().posegraph().SetPose({}, kMapName, room, high),
              StatusIs(absl::StatusCode::kInvalidArgument, beyond));
  EXPECT_EQ(Digest(), digest);
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
}

TEST_F(IntegrationTest, ACancelledRebuildChangesNothing) {
  MakeMap();
  UploadRooms(60);
  const std::string digest = Digest();
  const auto tiles = AllTiles(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listed, db().tiles().List({}, kMapName, {}));
  JobInfo last;
  // A job that ends before it can be cancelled is no failure, so there are several tries.
  for (int attempt = 0; attempt < 20 && last.state != JobState::kCancelled; ++attempt) {
    STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Start({}, kMapName, "rebuild", {}));
    while (last.state == JobState::kQueued) {
      STRATA_ASSERT_OK_AND_ASSIGN(last, db().jobs().Get({}, kMapName, last.id));
    }
    STRATA_ASSERT_OK(db().jobs().Cancel({}, kMapName, last.id));
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMapName, last.id, [&last](const JobInfo& info) {
      last = info;
      return absl::OkStatus();
    }));
  }
  EXPECT_EQ(last.state, JobState::kCancelled);
  EXPECT_LT(last.progress, 1.0);
  EXPECT_EQ(Digest(), digest);
  EXPECT_EQ(AllTiles(db()), tiles);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto now, db().tiles().List({}, kMapName, {}));
  ASSERT_EQ(now.size(), listed.size());
  for (std::size_t i = 0; i < now.size(); ++i) EXPECT_EQ(now[i].version, listed[i].version);
  EXPECT_EQ(RunJob(db(), "verify").state, JobState::kSucceeded);
}

TEST_F(IntegrationTest, MapsAreMadeListedAndDeleted) {
  MakeMap();
  EXPECT_THAT(db().maps().Create({}, kMapName, SmallMap()),
              StatusIs(absl::StatusCode::kAlreadyExists, HasSubstr(kMapName)));
  EXPECT_THAT(db().maps().Create({}, "../evil", SmallMap()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("map name")));
  EXPECT_THAT(OpenEngine(Options()),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("in use")));
  UploadRooms(2);
  STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  EXPECT_THAT(db().maps().Get({}, kMapName), StatusIs(absl::StatusCode::kNotFound, HasSubstr("")));
  EXPECT_FALSE(std::filesystem::exists(MapFile()));
  MakeMap();
  EXPECT_EQ(WaitIntegrated(db()).scans, 0U);
}

TEST_F(IntegrationTest, ForeignFileDoesNotKeepOthersFromBeingServed) {
  MakeMap();
  Close();
  Sql(MapFile("foreign"), "CREATE TABLE t (a); PRAGMA application_id = 7;");
  std::ofstream(MapFile("garbage")) << std::string(20'000, 'x');
  Sql(MapFile("newer"), "PRAGMA application_id = 1398035009; PRAGMA user_version = 99;");
  Reopen();
  EXPECT_THAT(db().maps().Get({}, kMapName), IsOk());
  EXPECT_THAT(db().maps().Get({}, "foreign"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("not a Strata map")));
  EXPECT_THAT(db().maps().Get({}, "garbage"), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("")));
  EXPECT_THAT(db().maps().Get({}, "newer"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("99")));
}

}  // namespace
}  // namespace strata::testing
