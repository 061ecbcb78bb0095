// Maps as files: made, listed, deleted, foreign.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Not;

class EngineMapsTest : public EngineTest {
 protected:
  static std::string Contents(const std::filesystem::path& file) {
    std::ostringstream contents;
    contents << std::ifstream(file, std::ios::binary).rdbuf();
    return contents.str();
  }
};

TEST_F(EngineMapsTest, MapsAreMadeListedAndDeleted) {
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

TEST_F(EngineMapsTest, ForeignFileDoesNotKeepOthersFromBeingServed) {
  MakeMap();
  Close();
  Sql("CREATE TABLE t (a); PRAGMA application_id = 7;", "foreign");
  std::ofstream(MapFile("garbage")) << std::string(20'000, 'x');
  Sql("PRAGMA application_id = 1398035009; PRAGMA user_version = 99;", "newer");
  Reopen();
  EXPECT_THAT(db().maps().Get({}, kMapName), IsOk());
  EXPECT_THAT(db().maps().Get({}, "foreign"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("not a Strata map")));
  EXPECT_THAT(db().maps().Get({}, "garbage"), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("")));
  EXPECT_THAT(db().maps().Get({}, "newer"),
              StatusIs(absl::StatusCode::kFailedPrecondition,
                       HasSubstr("format version 99 is newer than 3, the newest this program "
                                 "reads; update it")));
}

TEST_F(EngineMapsTest, OnlyFilesOfMapsAreDeleted) {
  Sql("CREATE TABLE t (a); PRAGMA application_id = 7;", "foreign");
  Sql("CREATE TABLE t (a); PRAGMA application_id = 1398035009; PRAGMA user_version = 99;", "newer");
  std::ofstream(MapFile("garbage")) << std::string(20'000, 'x');
  std::ofstream(MapFile("short")) << "SQLite";
  std::ofstream(MapFile("empty"));
  std::filesystem::create_directory(MapFile("folder"));
  Reopen();
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"foreign", "a database file of another application (application_id 7)"},
      {"garbage", "no database file"},
      {"short", "no database file"},
      {"empty", "an empty or unreadable file"},
      {"folder", "a directory"}};
  for (const auto& [name, kind] : kinds) {
    const std::string before = Contents(MapFile(name));
    EXPECT_THAT(db().maps().Delete({}, name),
                StatusIs(absl::StatusCode::kFailedPrecondition,
                         HasSubstr(name + ".strata is not a Strata map but " + kind)));
    EXPECT_TRUE(std::filesystem::exists(MapFile(name))) << name;
    EXPECT_EQ(Contents(MapFile(name)), before) << name;
    EXPECT_THAT(db().maps().Get({}, name), Not(IsOk())) << name;
  }
  STRATA_EXPECT_OK(db().maps().Delete({}, "newer"));  // a map, if one that cannot be read
  EXPECT_FALSE(std::filesystem::exists(MapFile("newer")));
  EXPECT_THAT(db().maps().Delete({}, "newer"), StatusIs(absl::StatusCode::kNotFound, _));
}

TEST_F(EngineMapsTest, ADamagedMapCanBeDeleted) {
  MakeMap();
  Close();
  Sql("DROP TABLE truth_map");
  Reopen();
  EXPECT_THAT(db().maps().Get({}, kMapName), Not(IsOk()));
  STRATA_EXPECT_OK(db().maps().Delete({}, kMapName));
  EXPECT_FALSE(std::filesystem::exists(MapFile()));
}

TEST_F(EngineMapsTest, OfFilesBesideMapsOnlyLeftJournalsAreRemoved) {
  MakeMap();
  Close();
  const std::vector<std::string> kept = {"world.strata", "gone.strata-copy", "notes-wal"};
  const std::vector<std::string> removed = {"gone.strata-wal", "gone.strata-shm"};
  for (const std::string& name : {kept[1], kept[2], removed[0], removed[1]}) {
    std::ofstream(directory_.path() / name) << "x";
  }
  Reopen();
  for (const std::string& name : kept) {
    EXPECT_TRUE(std::filesystem::exists(directory_.path() / name)) << name;
  }
  for (const std::string& name : removed) {
    EXPECT_FALSE(std::filesystem::exists(directory_.path() / name)) << name;
  }
}

TEST_F(EngineMapsTest, ANewerFileIsLeftAsItIs) {
  MakeMap();
  UploadRooms(1);
  WaitIntegrated(db());
  Close();
  Sql("PRAGMA user_version = 4");
  const std::string before = Contents(MapFile());
  Reopen();
  EXPECT_THAT(db().maps().Get({}, kMapName),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("update it")));
  Close();
  EXPECT_EQ(Contents(MapFile()), before);
  Sql("PRAGMA user_version = 3");
  Reopen();
  ExpectSound();
}

TEST_F(EngineMapsTest, AFileOfVersion1HasAllItHad) {
  Sql(Contents(SourcePath("tests/core/engine/map_v1.sql")));
  Reopen();
  ExpectSound();
  const MapStats stats = WaitIntegrated(db());
  EXPECT_EQ(stats.scans, 2U);
  EXPECT_EQ(stats.points, 80U);
  EXPECT_EQ(stats.patches, 69U);
  EXPECT_EQ(stats.epoch, 2U);
  EXPECT_EQ(stats.content_digest, "4e0604ee80d7fd19c477521250e5b021");
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo moved, db().scans().Get({}, kMapName, {"run", 1}));
  EXPECT_EQ(moved.header.time, absl::FromUnixMillis(11'500));
  EXPECT_TRUE(moved.T_map_scan.translation().isApprox(Eigen::Vector3d(2.0, 0.5, 1.1)));
  EXPECT_TRUE(moved.header.T_map_scan.translation().isApprox(Eigen::Vector3d(2.0, 0.5, 1.0)));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, db().planning().ListProfiles({}, kMapName));
  EXPECT_EQ(profiles.at("cart").radius_m, 0.5);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto jobs, db().jobs().List({}, kMapName));
  EXPECT_EQ(jobs.at(0).metrics.at("scans_checked"), 2.0);
}

TEST_F(EngineMapsTest, DerivedTablesOfAnotherFormatAreMadeAgain) {
  MakeMap();
  UploadRooms(2);
  const std::string digest = Digest();
  Close();
  Sql("UPDATE derived_state SET schema = 0; ALTER TABLE derived_mls_tile DROP COLUMN digest");
  Reopen();
  ExpectSound();
  EXPECT_EQ(Digest(), digest);
}

// A short command opens a map and reads it at once.
TEST_F(EngineMapsTest, WhoReadsTilesWaitsWhileTheyAreMadeAgain) {
  MakeMap();
  UploadRooms(2);
  const std::string digest = Digest();
  const MapStats before = WaitIntegrated(db());
  for (const bool at_once : {true, false}) {
    Close();
    Sql("UPDATE derived_state SET schema = 0");
    Reopen();
    if (at_once) {
      Close();  // in the middle of it
      Reopen();
    }
    STRATA_ASSERT_OK_AND_ASSIGN(const auto tiles, db().tiles().List({}, kMapName, {}));
    EXPECT_GT(tiles.size(), 0U);
    EXPECT_EQ(Digest(), digest);
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kMapName));
    EXPECT_EQ(after.tiles, before.tiles);
  }
}

TEST_F(EngineMapsTest, MapWithoutPointsKeepsItsContent) {
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
  ExpectSound();
  const PointCloud room = MakeRoom(2);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack,
                              Upload(db(), HeaderOf({"run", 2}, room, RoomPose(2)), room));
  EXPECT_TRUE(ack.already_present);
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(3, 3, 3)));
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, RoomPose(2)));
  EXPECT_EQ(Digest(), before.content_digest);
}

}  // namespace
}  // namespace strata::testing
