// Labels that scans are given: what counts them, and that nothing else changes.
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

class EngineLabelsTest : public EngineTest {
 protected:
  // Some label for every point of a room.
  static std::vector<std::uint16_t> Labels(std::uint64_t room) {
    std::vector<std::uint16_t> labels(MakeRoom(room).size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      labels[i] = static_cast<std::uint16_t>((i + room) % 5);
    }
    return labels;
  }
  absl::Status Label(std::uint64_t room) {
    return db().scans().SetLabels(
        {}, kMapName, {"run", room}, Labels(room), api::LabelMode::kReplace);
  }
  void UploadLabelled(std::uint64_t room) {
    PointCloud cloud = MakeRoom(room);
    cloud.label = Labels(room);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", room}, cloud, RoomPose(room)), cloud));
  }
};

TEST_F(EngineLabelsTest, TilesAreThoseOfScansThatWereUploadedWithTheLabels) {
  MakeMap();
  for (std::uint64_t room = 1; room <= 3; ++room) UploadLabelled(room);
  const std::string expected = Digest();
  const auto tiles = AllTiles(db());
  STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  MakeMap();
  UploadRooms(3);
  EXPECT_NE(Digest(), expected);
  for (std::uint64_t room = 1; room <= 3; ++room) STRATA_ASSERT_OK(Label(room));
  EXPECT_EQ(Digest(), expected);
  EXPECT_EQ(AllTiles(db()).size(), tiles.size());
  ExpectSound();
  EXPECT_EQ(RunJob(db(), "rebuild").metrics.at("tiles_changed"), 0.0);
  Close();
  Sql("UPDATE derived_state SET schema = 0");  // all derived data are dropped and made again
  Reopen();
  ExpectSound();  // once they are made
  EXPECT_EQ(Digest(), expected);
}

TEST_F(EngineLabelsTest, LabelsGoWhereTheirScanGoes) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  STRATA_ASSERT_OK(Label(1));
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 1}, PoseAt(20.0, 3.0, 0.4)));
  const std::string moved = Digest();
  ExpectSound();
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 1}));
  ExpectSound();
  STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  MakeMap();
  PointCloud cloud = MakeRoom(1);
  cloud.label = Labels(1);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 1}, cloud, PoseAt(20.0, 3.0, 0.4)), cloud));
  UploadRoom(2, RoomPose(2));
  EXPECT_EQ(Digest(), moved);
}

TEST_F(EngineLabelsTest, WatchersAreToldOfTheTiles) {
  MakeMap();
  UploadRooms(1);
  const MapStats before = WaitIntegrated(db());
  STRATA_ASSERT_OK(Label(1));
  std::size_t tiles = 0;
  STRATA_ASSERT_OK(
      db().maps().Watch({},
                        kMapName,
                        {.since = before.commit_sequence, .trajectory = "", .once = true},
                        [&](const api::MapUpdate& update) {
                          tiles += update.tiles.size();
                          EXPECT_EQ(update.epoch, before.epoch);
                          return absl::OkStatus();
                        }));
  EXPECT_GT(tiles, 0U);
}

TEST_F(EngineLabelsTest, WithoutPointsThereIsNothingToLabel) {
  MapParameters parameters = SmallMap();
  parameters.keep_points = false;
  MakeMap(parameters);
  UploadLabelled(1);
  WaitIntegrated(db());
  EXPECT_THAT(Label(1), StatusIs(Code::kFailedPrecondition, HasSubstr("run/1")));
  ExpectSound();
}

TEST_F(EngineLabelsTest, DamagedLabelsAreNamedAndMendedByNewOnes) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  STRATA_ASSERT_OK(Label(1));
  const std::string expected = Digest();
  Close();
  Sql("UPDATE truth_label SET bytes = CAST(substr(bytes, 1, 30) || x'00ff' || substr(bytes, 33) AS "
      "BLOB)");
  Reopen();
  const JobInfo found = RunJob(db(), "verify");
  EXPECT_EQ(found.state, JobState::kFailed);
  EXPECT_THAT(found.message, HasSubstr("scan run/1: labels"));
  STRATA_ASSERT_OK(Label(1));
  EXPECT_EQ(Digest(), expected);
  ExpectSound();
}

TEST_F(EngineLabelsTest, MissingLabelsAreNamed) {
  MakeMap();
  UploadRooms(1);
  WaitIntegrated(db());
  STRATA_ASSERT_OK(Label(1));
  Close();
  Sql("DELETE FROM truth_label");
  Reopen();
  EXPECT_THAT(RunJob(db(), "verify").message, HasSubstr("0 labels instead of 3000"));
}

}  // namespace
}  // namespace strata::testing
