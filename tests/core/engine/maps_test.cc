// Maps as files: made, listed, deleted, foreign.
#include <filesystem>
#include <fstream>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

class EngineMapsTest : public EngineTest {};

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
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("99")));
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
