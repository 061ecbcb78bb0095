// What verify says of damage, and what rebuild makes of it.
#include <iterator>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace strata::testing
