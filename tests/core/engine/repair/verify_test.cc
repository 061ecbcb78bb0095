// What verify says of damage, and what rebuild makes of it.
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class EngineVerifyTest : public EngineTest {};

TEST_F(EngineVerifyTest, DamagedTileIsDataLossVerifyNamesItAndRebuildMendsIt) {
  MakeMap();
  UploadRooms(3);
  WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  for (const std::string table : {"derived_surface_tile", "derived_mls_tile"}) {
    Close();
    Sql("UPDATE " + table +
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

TEST_F(EngineVerifyTest, DamagedPointsAreNamed) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  Close();
  Sql("UPDATE truth_chunk SET bytes = CAST(substr(bytes, 1, 100) || x'00ff' || substr(bytes, 103) "
      "AS BLOB) WHERE upload = (SELECT upload FROM truth_scan WHERE sequence = 2)");
  Reopen();
  const JobInfo job = RunJob(db(), "verify");
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("scan run/2"));
  EXPECT_THAT(db().scans().GetPoints(
                  {}, kMapName, {"run", 2}, [](const PointCloud&) { return absl::OkStatus(); }),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("run/2")));
}

// Columns that only counts and searches read.
TEST_F(EngineVerifyTest, ARowThatDiffersFromItsHeaderIsDamageThatNoRebuildMends) {
  for (const std::string column : {"points", "time_us", "point_bytes", "max_x"}) {
    MakeMap(SmallMap(), column);
    UploadRoom(1, RoomPose(1), column);
    UploadRoom(2, RoomPose(2), column);
    WaitIntegrated(db(), column);
    Close();
    Sql("UPDATE truth_scan SET " + column + " = " + column + " + 1 WHERE sequence = 2", column);
    Reopen();
    const JobInfo job = RunJob(db(), "verify", {}, column);
    EXPECT_EQ(job.state, JobState::kFailed) << column;
    EXPECT_THAT(job.message, StartsWith("1 mismatch: scan run/2: ")) << column;
    EXPECT_THAT(job.message, Not(HasSubstr("a rebuild mends"))) << column;
  }
}

TEST_F(EngineVerifyTest, ADamagedPoseOfAnEarlierEpochIsNamed) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  Close();
  Sql("UPDATE truth_map SET epoch = 2; INSERT INTO truth_epoch (epoch, created_us, reason) VALUES "
      "(2, 0, 'again'); INSERT INTO truth_pose SELECT scan, 2, pose, origin, aligned, message, "
      "overlap, rms_m, iterations FROM truth_pose");
  Reopen();
  ExpectSound();
  Close();
  Sql("UPDATE truth_pose SET pose = CAST(substr(pose, 1, 20) || x'5a' || substr(pose, 22) AS BLOB) "
      "WHERE epoch = 1 AND scan = (SELECT number FROM truth_scan WHERE sequence = 2)");
  Reopen();
  EXPECT_THAT(RunJob(db(), "verify").message, StartsWith("1 mismatch: scan run/2: in epoch 1: "));
}

// No checksum tells of these, but they cannot be.
TEST_F(EngineVerifyTest, NumbersThatMakeNoSenseAreNamed) {
  const std::pair<const char*, const char*> faults[] = {
      {"UPDATE truth_map SET commit_sequence = 1", "the map's clock, 1, is behind"},
      {"UPDATE truth_epoch SET epoch = 257", "epoch 257 of 1, now 1"},
      {"UPDATE truth_profile SET radius_m = -0.4 WHERE name = 'cart'", "profile cart: "},
      {"UPDATE truth_class SET id = 1025", "class 1025: "},
      {"UPDATE truth_scan SET state = 18 WHERE sequence = 2", "scan run/2: state 18 is none"}};
  int number = 0;
  for (const auto& [sql, named] : faults) {
    const std::string map = "map" + std::to_string(++number);
    MakeMap(SmallMap(), map);
    UploadRoom(1, RoomPose(1), map);
    UploadRoom(2, RoomPose(2), map);
    STRATA_ASSERT_OK(db().planning().SetProfile({}, map, "cart", RobotProfile()));
    STRATA_ASSERT_OK(db().maps().SetClass({}, map, {1, "ground", {1, 2, 3}}));
    WaitIntegrated(db(), map);
    Close();
    Sql(sql, map);
    Reopen();
    EXPECT_THAT(RunJob(db(), "verify", {}, map).message, HasSubstr(named)) << sql;
  }
}

TEST_F(EngineVerifyTest, ADamagedRowHidesNoOtherFromAListing) {
  MakeMap();
  UploadRooms(4);
  WaitIntegrated(db());
  Close();
  Sql("UPDATE truth_scan SET header = CAST(x'00' || substr(header, 2) AS BLOB) WHERE sequence = 2");
  Reopen();
  std::vector<std::uint64_t> listed;
  EXPECT_THAT(db().scans().List({},
                                kMapName,
                                {},
                                [&](const ScanInfo& scan) {
                                  listed.push_back(scan.header.id.sequence);
                                  return absl::OkStatus();
                                }),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("run/2")));
  EXPECT_THAT(listed, ::testing::ElementsAre(1, 3, 4));
}

// The cure that verify names.
TEST_F(EngineVerifyTest, ADamagedScanThatIsDeletedAndUploadedAgainIsSound) {
  MakeMap();
  UploadRooms(2);
  const std::string digest = Digest();
  Close();
  Sql("UPDATE truth_scan SET points = points + 1 WHERE sequence = 1");
  Sql("UPDATE truth_chunk SET bytes = x'00' WHERE upload = (SELECT upload FROM truth_scan WHERE "
      "sequence = 2)");
  Reopen();
  const JobInfo job = RunJob(db(), "verify");
  EXPECT_THAT(job.message, HasSubstr("delete the scan and upload it again"));
  EXPECT_THAT(job.message, Not(HasSubstr("a rebuild mends")));
  for (const std::uint64_t i : {2, 1}) {  // tiles are made again from readable scans only
    STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", i}));
    UploadRoom(i, RoomPose(i));
  }
  WaitIntegrated(db());
  ExpectSound();
  EXPECT_EQ(Digest(), digest);
}

TEST_F(EngineVerifyTest, EverythingDamagedIsNamed) {
  MakeMap();
  UploadRooms(4);
  const PointCloud large = MakeRoom(5, 90'000);  // three pieces
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 5}, large, RoomPose(5)), large));
  WaitIntegrated(db());
  Close();
  const std::string spoilt =
      " = CAST(substr(bytes, 1, 40) || x'5a5a' || substr(bytes, 43) AS BLOB) ";
  const std::string piece = "UPDATE truth_chunk SET bytes" + spoilt +
                            "WHERE upload = (SELECT upload FROM truth_scan WHERE sequence = ";
  Sql("UPDATE truth_scan SET header = CAST(x'00' || substr(header, 2) AS BLOB) WHERE sequence IN "
      "(1, 3)");
  Sql(piece + "2)");
  Sql(piece + "5) AND ordinal IN (0, 2)");
  Sql("UPDATE derived_surface_tile SET bytes" + spoilt +
      "WHERE level = 0 AND (x, y) IN ((0, 0), "
      "(-1, 0))");
  Sql("UPDATE derived_mls_tile SET bytes" + spoilt + "WHERE (x, y) = (0, 0)");
  Reopen();
  const JobInfo job = RunJob(db(), "verify");
  EXPECT_EQ(job.state, JobState::kFailed);
  for (const char* damaged : {"scan run/1",
                              "scan run/3",
                              "scan run/2: piece 0",
                              "scan run/5: piece 0",
                              "scan run/5: piece 2",
                              "tile 0/0/0 (served)",
                              "tile 0/-1/0 (served)",
                              "tile 0/0/0 (statistics)"}) {
    EXPECT_THAT(job.message, HasSubstr(damaged));
  }
  EXPECT_THAT(job.message, HasSubstr("8 mismatches"));
  EXPECT_EQ(job.metrics.at("mismatches"), 8.0);
  EXPECT_EQ(job.metrics.at("scans_checked"), 5.0);
}

// With sound truth every tile is compared with what it should be.
TEST_F(EngineVerifyTest, EveryDamagedTileIsNamedAndMended) {
  MakeMap();
  UploadRooms(4);
  const std::string digest = Digest();
  const auto tiles = AllTiles(db());
  Close();
  Sql("UPDATE derived_surface_tile SET bytes = x'00'");
  Sql("UPDATE derived_mls_tile SET bytes = x'00'");
  Reopen();
  const JobInfo job = RunJob(db(), "verify");
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, EndsWith("; a rebuild mends tiles"));
  for (const auto& [key, bytes] : tiles) {
    EXPECT_THAT(job.message, HasSubstr("tile " + key.ToString() + " (served)"));
    if (key.level > 0) continue;
    EXPECT_THAT(job.message, HasSubstr("tile " + key.ToString() + " (statistics)"));
  }
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  ExpectSound();
  EXPECT_EQ(Digest(), digest);
}

}  // namespace
}  // namespace strata::testing
