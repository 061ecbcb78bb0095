// Profiles, plans and samples on the tiles; world_planning_test.cc has whole worlds.
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EnginePlanningTest : public EngineTest {};

TEST_F(EnginePlanningTest, ProfileChangeIsReversibleAndRaisesOnlyChangedVersions) {
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
  ExpectSound();
  STRATA_ASSERT_OK(db().planning().SetProfile({}, kMapName, api::kDefaultProfile, {}));
  const auto after = AllTiles(db());
  for (const auto& [key, bytes] : before) {
    EXPECT_EQ(DecodeSurfaceTile(bytes)->surfaces, DecodeSurfaceTile(after.at(key))->surfaces);
  }
}

// A floor and a deck of 0.2 m over it, which one robot sees from below and the other from above.
TEST_F(EnginePlanningTest, ADeckIsGroundOnceItWasSeenFromAbove) {
  const auto square = [](double half_m, double z_m, PointCloud& cloud) {
    for (double y = -half_m; y < half_m; y += 0.05) {
      for (double x = -half_m; x < half_m; x += 0.05) {
        cloud.points.push_back(Eigen::Vector3d(x, y, z_m).cast<float>());
      }
    }
  };
  PointCloud below;
  square(6.0, -1.0, below);
  square(3.0, 1.5, below);
  PointCloud above;
  square(3.0, -1.2, above);
  const auto traversability = [&] {
    WaitIntegrated(db());
    std::vector<Traversability> result;
    const auto columns = db().planning().SampleSurfaces({}, kMapName, {{0.05, 0.05}});
    EXPECT_THAT(columns, testing::IsOk());
    if (!columns.ok()) return result;
    for (const Surface& s : columns->at(0).surfaces) result.push_back(s.traversability);
    return result;
  };
  for (const bool keep_points : {true, false}) {
    SCOPED_TRACE(keep_points);
    MapParameters parameters = SmallMap();
    parameters.keep_points = keep_points;
    MakeMap(parameters);
    const auto at_height = [](double z_m) { return Pose(Eigen::Translation3d(0.0, 0.0, z_m)); };
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"low", 1}, below, at_height(1.0)), below));
    EXPECT_THAT(traversability(),
                ElementsAre(Traversability::kTraversable, Traversability::kUnderside));
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"high", 1}, above, at_height(3.9)), above));
    EXPECT_THAT(traversability(),
                ElementsAre(Traversability::kTraversable, Traversability::kTraversable));
    ExpectSound();
    STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"high", 1}));
    EXPECT_THAT(traversability(),
                ElementsAre(Traversability::kTraversable, Traversability::kUnderside));
    STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  }
}

TEST_F(EnginePlanningTest, PlansAndSamplesOnTheTiles) {
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

// A plane of 20 tiles of 12.8 m in a row, the third of them damaged.
TEST_F(EnginePlanningTest, OnlyWhatNeedsADamagedTileIsDataLoss) {
  MakeMap();
  PointCloud floor;
  for (double x = 0.0; x < 256.0; x += 0.05) {
    for (double y = 0.0; y < 6.0; y += 0.05) {
      floor.points.emplace_back(static_cast<float>(x + 0.02), static_cast<float>(y + 0.02), 0.0F);
    }
  }
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 1}, floor, PoseAt(0, 0)), floor, 40'000));
  WaitIntegrated(db());
  const TileKey damaged{0, 2, 0};
  const auto plan = [&](double from_x_m, double to_x_m) {
    PlanQuery query;
    query.from = {.x_m = from_x_m, .y_m = 3.0};
    query.to = {.x_m = to_x_m, .y_m = 3.0};
    return db().planning().PlanPath({}, kMapName, query);
  };
  const auto sample = [&](const std::vector<Eigen::Vector2d>& places) {
    return db().planning().SampleSurfaces({}, kMapName, places);
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult sound, plan(5.0, 250.0));
  EXPECT_TRUE(sound.found()) << sound.message;
  Close();
  DamageSurfaceTile(damaged);
  Sql("DELETE FROM derived_prepared_tile");  // those made in time: plans over them need no other
  Reopen();
  const auto data_loss =
      StatusIs(absl::StatusCode::kDataLoss,
               HasSubstr("tile 0/2/0 is damaged, a rebuild of the map mends it"));
  for (int i = 0; i < 2; ++i) {  // a failure leaves nothing behind that changes later answers
    EXPECT_THAT(plan(5.0, 250.0), data_loss);
    EXPECT_THAT(plan(30.0, 100.0), data_loss);
    EXPECT_THAT(plan(250.0, 30.0), data_loss);
    STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult elsewhere, plan(100.0, 250.0));
    EXPECT_TRUE(elsewhere.found()) << elsewhere.message;
    EXPECT_THAT(sample({{30.0, 3.0}}), data_loss);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto columns, sample({{20.0, 3.0}, {45.0, 3.0}}));
    EXPECT_EQ(columns.at(0).surfaces.size(), 1U);
    EXPECT_EQ(columns.at(1).surfaces.size(), 1U);
  }
  EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult mended, plan(5.0, 250.0));
  EXPECT_EQ(mended.waypoints, sound.waypoints);
  STRATA_EXPECT_OK(sample({{30.0, 3.0}}));
}

}  // namespace
}  // namespace strata::testing
