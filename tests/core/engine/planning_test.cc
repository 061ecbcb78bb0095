// Profiles, plans and samples on the tiles; world_planning_test.cc has whole worlds.
#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

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

}  // namespace
}  // namespace strata::testing
