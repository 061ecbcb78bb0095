// What was seen from below alone, and what no beam hit: no ground, and no drop beneath it.
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/tile_key.h"
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

// A deck of 3 m over a road, as long as one likes, of which nobody has seen some cells.
DrawnMap DeckWithout(const std::vector<CellIndex>& unseen, double road_m = 0.0) {
  DrawnMap map = MapFromDrawing("........\n........", {{'.', {{road_m}, {3.0, 0.3}}}}, 10);
  for (const CellIndex cell : unseen) map[cell] = {{road_m}};
  return map;
}

TEST(UndersideTest, CellsOfADeckThatNoBeamHitAreAGapAndNoDrop) {
  const PlanEndpoint from = At(1.05, 1.05, 3.0);
  const PlanEndpoint to = At(7.05, 1.05, 3.0);
  // All over the deck, so that there is no way between them.
  std::vector<CellIndex> sparse;
  for (int y = 1; y < 19; y += 2) {
    for (int x = 31; x < 60; x += 2) sparse.push_back({x, y});
  }
  const PlanResult over = PlanIn(DeckWithout(sparse), from, to);
  EXPECT_TRUE(over.found()) << over.message;
  EXPECT_NEAR(over.cost, 6.0, 0.5);
  // Nor is its underside ground that a step leads to, where nobody knew it for one.
  DrawnMap undersides = DeckWithout(sparse);
  for (const CellIndex cell : sparse) undersides[cell].push_back({.z_m = 2.7});
  EXPECT_NEAR(PlanIn(undersides, from, to).cost, over.cost, 1e-6);
  // What lies only a little lower may have been seen from above.
  const PlanResult ditch = PlanIn(DeckWithout(sparse, 2.8), from, to);
  EXPECT_EQ(ditch.obstruction, Obstruction::kDrop) << ditch.message;
  // What lies between rings may be long, but not wider.
  std::vector<CellIndex> narrow;
  std::vector<CellIndex> broad;
  for (int y = 0; y < 20; ++y) {
    narrow.insert(narrow.end(), {{40, y}, {41, y}});
    broad.insert(broad.end(), {{40, y}, {41, y}, {42, y}});
  }
  EXPECT_TRUE(PlanIn(DeckWithout(narrow), from, to).found());
  const PlanResult wide = PlanIn(DeckWithout(broad), from, to);
  EXPECT_EQ(wide.obstruction, Obstruction::kDrop) << wide.message;
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
