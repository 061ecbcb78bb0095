// Paths in maps made of simulated scans, each one driven again through the exact world.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/sweep.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

PlanEndpoint AtHeight(const Vector3d& p) { return {.x_m = p.x(), .y_m = p.y(), .z_m = p.z()}; }
PlanEndpoint AtLevel(const Vector3d& p, int level) {
  return {.x_m = p.x(), .y_m = p.y(), .level = level};
}

class WorldPlanningTest : public EngineTest {
 protected:
  void MakeMapOf(World world, double cell_size_m = 0.1) {
    world_ = std::move(world);
    MapParameters parameters;
    parameters.mls.cell_size_m = cell_size_m;
    MakeMap(parameters);
  }
  // Drives a robot of the world, uploads its scans with exact poses and waits for the map.
  void Drive(const Robot& robot, double step_m) {
    const std::vector<Pose> poses = testing::Drive(world_.scene, robot.waypoints, step_m, 1.2);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const PointCloud cloud = SimulateScan(world_.scene, sensor_, poses[i], i + 1);
      STRATA_ASSERT_OK(Upload(db(), HeaderOf({robot.name, i + 1}, cloud, poses[i]), cloud, 40'000));
    }
    EXPECT_EQ(WaitIntegrated(db()).scans_failed, 0U);
  }
  void DriveAll(double step_m) {
    for (const Robot& robot : world_.robots) Drive(robot, step_m);
  }
  const Vector3d& Place(const char* name) const { return world_.places.at(name); }

  PlanResult Plan(const PlanEndpoint& from,
                  const PlanEndpoint& to,
                  const RobotProfile& profile = {}) {
    PlanQuery query;
    query.from = from;
    query.to = to;
    query.profile = profile;
    const auto result = db().planning().PlanPath({}, kMapName, query);
    STRATA_EXPECT_OK(result);
    return result.value_or(PlanResult());
  }
  // A path from the place `from` to the place `to` that the robot can drive in the exact world; the
  // ground it drives over.
  std::vector<Vector3d> Driven(const PlanResult& result, const RobotProfile& profile = {}) {
    EXPECT_TRUE(result.found()) << result.message;
    const Swept swept = Sweep(world_.scene, result.waypoints, profile);
    EXPECT_EQ(swept.collision, "");
    return swept.ground;
  }
  std::vector<Vector3d> Driven(const char* from, const char* to, const RobotProfile& profile = {}) {
    SCOPED_TRACE(std::string(from) + " to " + to);
    return Driven(Plan(AtHeight(Place(from)), AtHeight(Place(to)), profile), profile);
  }

  World world_;
  SensorOptions sensor_;
};

// The point of `ground` nearest to (x, y) in the plane.
Vector3d NearestTo(const std::vector<Vector3d>& ground, double x, double y) {
  const auto distance = [&](const Vector3d& p) { return (p.head<2>() - Vector2d(x, y)).norm(); };
  const auto nearest =
      std::min_element(ground.begin(), ground.end(), [&](const Vector3d& a, const Vector3d& b) {
        return distance(a) < distance(b);
      });
  return nearest == ground.end() ? Vector3d::Constant(1e9) : *nearest;
}

double LengthOf(const std::vector<Vector3d>& ground) {
  double length = 0.0;
  for (std::size_t i = 1; i < ground.size(); ++i) length += (ground[i] - ground[i - 1]).norm();
  return length;
}

class BridgeTest : public WorldPlanningTest, public ::testing::WithParamInterface<bool> {
 protected:
  void MakeBridge(double clearance_m) {
    MakeMapOf(BridgeWorld({.parapets = GetParam(), .clearance_m = clearance_m}));
  }
  // Of the map of both robots' drives, to which it adds another one.
  void IsLeftByItsRampsAndNotOverItsEdge();
};

TEST_P(BridgeTest, IsCrossedAndPassedUnderAtTheSamePlaceAndLeftByItsRamps) {
  MakeBridge(3.0);
  DriveAll(1.5);
  constexpr double kMoved = 0.6;  // a goal that no scan has seen moves by radius + max_gap at most
  const Vector3d& deck = Place("deck");
  for (const bool by_level : {false, true}) {
    SCOPED_TRACE(by_level ? "by level" : "by height");
    const PlanEndpoint top = by_level ? AtLevel(deck, 1) : AtHeight(deck);
    const PlanEndpoint road = by_level ? AtLevel(deck, 0) : AtHeight(Place("under"));
    for (const char* foot : {"west", "east"}) {
      const std::vector<Vector3d> over = Driven(Plan(AtHeight(Place(foot)), top));
      EXPECT_LT((over.back() - deck).norm(), kMoved);
      EXPECT_LT(std::abs(NearestTo(over, 0.5 * Place(foot).x(), 0.0).y()), 2.0);  // on the ramp
    }
    for (const char* end : {"south", "north"}) {
      const std::vector<Vector3d> under = Driven(Plan(road, AtHeight(Place(end))));
      EXPECT_LT((under.front() - Place("under")).norm(), kMoved);
      for (const Vector3d& p : under) ASSERT_NEAR(p.z(), 0.0, 0.05);
      EXPECT_LT(LengthOf(under), 21.0);
    }
  }
  for (const Vector3d& p : Driven("south", "north")) ASSERT_NEAR(p.z(), 0.0, 0.05);
  IsLeftByItsRampsAndNotOverItsEdge();
}

void BridgeTest::IsLeftByItsRampsAndNotOverItsEdge() {
  // Known ground from both ramps' feet to the road.
  const double west = Place("west").x();
  Drive({"beside", {{west, 0, 0}, {west, -5, 0}, {-west, -5, 0}, {-west, 0, 0}}}, 1.5);
  // Over the edge it would be 6 m at most; by a ramp it is 23 m to its foot and as far back.
  constexpr double kByRamp = 2 * (6.0 + 17.0);
  const PlanEndpoint top = AtHeight(Place("deck"));
  for (const Vector3d& low : {Place("under"), Vector3d(0.0, -5.0, 0.0)}) {
    EXPECT_GT(LengthOf(Driven(Plan(top, AtHeight(low)))), kByRamp);
    EXPECT_GT(LengthOf(Driven(Plan(AtHeight(low), top))), kByRamp);
  }
}

TEST_P(BridgeTest, IsNotPassedUnderByWhoIsTooTall) {
  MakeBridge(1.5);
  Drive(world_.robots[1], 1.5);  // "under" alone: it has seen no way around
  RobotProfile tall;
  tall.height_m = 1.8;
  const PlanEndpoint south = AtHeight(Place("south"));
  const PlanEndpoint north = AtHeight(Place("north"));
  for (const Vector3d& p : Driven(Plan(south, north))) ASSERT_NEAR(p.z(), 0.0, 0.05);
  for (const bool northwards : {true, false}) {
    const PlanResult none = northwards ? Plan(south, north, tall) : Plan(north, south, tall);
    EXPECT_EQ(none.reason, PlanReason::kBlocked) << none.message;
    EXPECT_EQ(none.obstruction, Obstruction::kClearance) << none.message;
    EXPECT_NEAR(none.obstruction_value, 1.5, 0.05);
    ASSERT_TRUE(none.where.has_value());
    EXPECT_LT(std::abs(none.where->x()), 6.1);  // at the edge of the deck, on its own side
    EXPECT_NEAR(none.where->y(), northwards ? -2.0 : 2.0, 0.15);
    EXPECT_NEAR(none.where->z(), 0.0, 0.05);
    EXPECT_THAT(none.message, HasSubstr("blocked by clearance of 1.5"));
    EXPECT_TRUE(none.waypoints.empty());
  }
  const PlanResult beneath = Plan(south, AtHeight(Place("under")), tall);
  EXPECT_EQ(beneath.reason, PlanReason::kGoalNotOnSurface) << beneath.message;
  EXPECT_EQ(beneath.obstruction, Obstruction::kClearance) << beneath.message;
  // Over the same place it can go.
  Drive(world_.robots[0], 1.5);
  EXPECT_NEAR(Driven("west", "deck", tall).back().z(), 1.9, 0.05);
  EXPECT_NEAR(Driven("deck", "east", tall).front().z(), 1.9, 0.05);
  // And if the scans from the deck show a way around, that is one.
  const PlanResult around = Plan(south, north, tall);
  if (around.found()) {
    EXPECT_GT(LengthOf(Driven(around, tall)), 2 * (6.0 + 9.5));
  }
}

INSTANTIATE_TEST_SUITE_P(Parapets, BridgeTest, ::testing::Bool(), [](const auto& parapets) {
  return parapets.param ? "With" : "Without";
});

TEST_F(WorldPlanningTest, CarParkStoreysAreJoinedByTheRampAndOtherwiseIgnoreEachOther) {
  MakeMapOf(CarParkWorld());
  DriveAll(1.5);
  const Vector3d& below = Place("below");
  const Vector3d& above = Place("above");
  for (const bool by_level : {false, true}) {
    SCOPED_TRACE(by_level ? "by level" : "by height");
    const PlanEndpoint lower = by_level ? AtLevel(below, 0) : AtHeight(below);
    const PlanEndpoint upper = by_level ? AtLevel(above, 1) : AtHeight(above);
    for (const bool up : {true, false}) {
      const std::vector<Vector3d> ground =
          up ? Driven(Plan(lower, upper)) : Driven(Plan(upper, lower));
      // The ramp, 4 m wide, rises from (-8, 0, 0) to (8, 0, 3.2).
      for (const double x : {-7.0, -4.0, 0.0, 4.0, 7.0}) {
        const Vector3d on_ramp = NearestTo(ground, x, 0.0);
        EXPECT_LT((on_ramp.head<2>() - Vector2d(x, 0.0)).norm(), 2.0) << x;
        EXPECT_NEAR(on_ramp.z(), 0.2 * (on_ramp.x() + 8.0), 0.05) << x;
      }
    }
  }
  for (const double z : {0.0, 3.2}) {
    SCOPED_TRACE(z);
    const std::vector<Vector3d> along =
        Driven(Plan(AtHeight({-16, -9.5, z}), AtHeight({17, -9.5, z})));
    for (const Vector3d& p : along) ASSERT_NEAR(p.z(), z, 0.05);
    EXPECT_LT(LengthOf(along), 33.0 * 1.05);
    // Around the ramp's foot below, around its well above.
    for (const Vector3d& p : Driven(Plan(AtHeight({0, 5, z}), AtHeight({0, -9.5, z})))) {
      ASSERT_NEAR(p.z(), z, 0.05);
    }
  }
}

TEST_F(WorldPlanningTest, CampusPathsGoAroundBuildings) {
  constexpr std::uint64_t kSeed = 20261121;
  SCOPED_TRACE(kSeed);
  sensor_.columns = 360;  // enough for the larger cells, and a third of the time
  MakeMapOf(CampusWorld(), 0.2);
  DriveAll(4.0);
  Driven("start", "far");
  std::vector<Vector3d> driven;
  for (const Robot& robot : world_.robots) {
    for (const Pose& pose : testing::Drive(world_.scene, robot.waypoints, 5.0, 0.0)) {
      driven.push_back(pose.translation());
    }
  }
  Random random(kSeed);
  int obstructed = 0;
  for (int query = 0; query < 12; ++query) {
    const Vector3d& from = driven[random.Bits() % driven.size()];
    const Vector3d& to = driven[random.Bits() % driven.size()];
    SCOPED_TRACE(::testing::Message() << from.transpose() << " to " << to.transpose());
    const double length_m = LengthOf(Driven(Plan(AtHeight(from), AtHeight(to))));
    EXPECT_GE(length_m, (to - from).norm() - 1.0);
    obstructed += Sweep(world_.scene, {from, to}, RobotProfile()).collision.empty() ? 0 : 1;
  }
  EXPECT_GE(obstructed, 3);
}

}  // namespace
}  // namespace strata::testing
