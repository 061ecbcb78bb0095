// What was seen from below alone: no ground, and no drop beneath it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/plan.h"
#include "tests/core/planning/small_robot.h"
#include "tests/support/drawing.h"

namespace strata {
namespace {

using ::strata::testing::At;
using ::strata::testing::DrawnMap;
using ::strata::testing::MapFromDrawing;
using ::strata::testing::PlanIn;
using ::testing::HasSubstr;

// A deck over a road with a strip across it whose top no beam has hit: its underside alone, and the
// road below.
TEST(UndersideTest, AStripOfWhichOnlyTheUndersideWasSeenIsAGapAndNoDrop) {
  const auto deck = [](int strip_cells, bool underside) {
    DrawnMap map = MapFromDrawing("........\n........", {{'.', {{0.0}, {3.0, 0.3}}}}, 10);
    for (int y = 0; y < 20; ++y) {
      for (int x = 40; x < 40 + strip_cells; ++x) {
        map[{x, y}] = {{0.0}};
        if (underside) map[{x, y}].push_back({.z_m = 2.7, .underside = true});
      }
    }
    return map;
  };
  const PlanEndpoint from = At(1.05, 1.05, 3.0);
  const PlanEndpoint to = At(7.05, 1.05, 3.0);
  const PlanResult bridged = PlanIn(deck(3, true), from, to);
  ASSERT_TRUE(bridged.found()) << bridged.message;
  ASSERT_EQ(bridged.gaps.size(), 1U);
  EXPECT_NEAR(bridged.gaps[0].length_m, 0.4, 1e-6);
  EXPECT_EQ(PlanIn(deck(4, true), from, to).reason, PlanReason::kUnknownGround);
  const PlanResult through = PlanIn(deck(3, false), from, to);
  EXPECT_EQ(through.obstruction, Obstruction::kDrop) << through.message;
  // The road is free below either, and nobody is asked to stand on the underside.
  EXPECT_TRUE(PlanIn(deck(4, true), At(1.05, 1.05, 0.0), At(7.05, 1.05, 0.0)).found());
  const PlanResult ceiling = PlanIn(deck(40, true), from, At(6.05, 1.05, 2.7));
  EXPECT_EQ(ceiling.reason, PlanReason::kGoalNotOnSurface) << ceiling.message;
  EXPECT_THAT(ceiling.message, HasSubstr("cannot stand at (6.05, 1.05, 2.70): unknown ground"));
  const PlanResult onto = PlanIn(deck(4, true), from, At(4.15, 1.05, 2.7));
  EXPECT_EQ(onto.reason, PlanReason::kFound) << onto.message;
  EXPECT_NEAR(onto.waypoints.back().z(), 3.0, 1e-6);
}

TEST(UndersideTest, NobodyStandsOnAnUndersideAmongTopsThatAStepWouldReach) {
  DrawnMap map = MapFromDrawing("....\n....", {{'.', {{3.0, 0.05}}}}, 10);
  map[{20, 10}] = {{.z_m = 2.95, .underside = true}};
  const PlanResult result = PlanIn(map, At(2.05, 1.05, 2.95), At(3.05, 1.05, 3.0));
  ASSERT_TRUE(result.found()) << result.message;
  EXPECT_NEAR(result.waypoints.front().z(), 3.0, 1e-6);
  EXPECT_THAT(result.message, HasSubstr("start moved 0.10 m"));
}

}  // namespace
}  // namespace strata
