#include "tests/support/simulator/worlds.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

std::vector<Pose> DriveOf(const World& world, const std::string& name) {
  std::vector<Robot> robots = world.robots;
  robots.insert(robots.end(), world.loops.begin(), world.loops.end());
  const auto robot =
      std::find_if(robots.begin(), robots.end(), [&](const Robot& r) { return r.name == name; });
  return Drive(world.scene, robot->waypoints, 1.0, 1.2);
}

void ExpectPlacesOnSurfaces(const World& world) {
  for (const auto& [name, place] : world.places) {
    EXPECT_NEAR(world.scene.GroundBelow(place.x(), place.y(), place.z() + 0.5).value_or(1e9),
                place.z(),
                0.05)
        << name;
  }
}

double HighestSensor(const std::vector<Pose>& poses) {
  double highest = -1e9;
  for (const Pose& pose : poses) highest = std::max(highest, pose.translation().z());
  return highest;
}

// No robot drives through a wall: consecutive sensor positions see each other.
void ExpectDrivesAreFree(const World& world) {
  std::vector<Robot> robots = world.robots;
  robots.insert(robots.end(), world.loops.begin(), world.loops.end());
  for (const Robot& robot : robots) {
    const std::vector<Pose> poses = DriveOf(world, robot.name);
    for (std::size_t i = 1; i < poses.size(); ++i) {
      const Vector3d way = poses[i].translation() - poses[i - 1].translation();
      EXPECT_FALSE(
          world.scene.Cast(poses[i - 1].translation(), way.normalized(), way.norm()).has_value())
          << robot.name << " between " << i - 1 << " and " << i;
    }
  }
}

TEST(WorldsTest, BridgeCanBeCrossedAndPassedUnder) {
  for (const bool parapets : {true, false}) {
    const World world = BridgeWorld({.parapets = parapets});
    ExpectPlacesOnSurfaces(world);
    ExpectDrivesAreFree(world);
    EXPECT_NEAR(HighestSensor(DriveOf(world, "over")), 3.4 + 1.2, 0.01);
    EXPECT_NEAR(HighestSensor(DriveOf(world, "under")), 1.2, 1e-9);
    EXPECT_NEAR(world.scene.GroundBelow(0, 1.93, 10).value(), parapets ? 4.3 : 3.4, 1e-9);
    EXPECT_NEAR(world.scene.GroundBelow(-14.5, 1.93, 10).value() -
                    world.scene.GroundBelow(-14.5, 0.0, 10).value(),
                parapets ? 0.92 : 0.0,
                0.05);
    EXPECT_NEAR(world.scene.Cast({0, 0, 0.1}, Vector3d::UnitZ(), 50).value(), 2.9, 1e-9);
  }
}

TEST(WorldsTest, LowBridgeHasTheClearanceAskedFor) {
  const World world = BridgeWorld({.parapets = false, .clearance_m = 1.5});
  ExpectPlacesOnSurfaces(world);
  EXPECT_NEAR(world.scene.Cast({0, 0, 0.1}, Vector3d::UnitZ(), 50).value(), 1.4, 1e-9);
}

TEST(WorldsTest, CarParkVisitorReachesTheUpperStoreyByTheRamp) {
  const World world = CarParkWorld();
  ExpectPlacesOnSurfaces(world);
  ExpectDrivesAreFree(world);
  EXPECT_NEAR(HighestSensor(DriveOf(world, "visitor")), 3.2 + 1.2, 0.05);
  EXPECT_EQ(world.places.at("above").head<2>(), world.places.at("below").head<2>());
}

TEST(WorldsTest, CampusRobotsDriveAboutHalfAKilometreEach) {
  const World world = CampusWorld();
  ExpectPlacesOnSurfaces(world);
  ExpectDrivesAreFree(world);
  for (const Robot& robot : world.robots) {
    EXPECT_NEAR(static_cast<double>(DriveOf(world, robot.name).size()), 550.0, 80.0) << robot.name;
  }
}

TEST(WorldsTest, CityRobotsMeetOnTheStreetBetweenTheirDistricts) {
  const World world = CityWorld(2);
  ASSERT_EQ(world.robots.size(), 2U);
  ExpectDrivesAreFree(world);
  const std::vector<Pose> west = DriveOf(world, "robot0");
  const std::vector<Pose> east = DriveOf(world, "robot1");
  EXPECT_NEAR(static_cast<double>(west.size()), 6900.0, 20.0);
  std::size_t met = 0;
  for (std::size_t i = 0; i < west.size(); i += 10) {
    met += std::any_of(east.begin(), east.end(), [&](const Pose& T) {
      return (T.translation() - west[i].translation()).norm() < 1.0;
    });
  }
  EXPECT_GT(met, 40U);
}

// Of the last poses, how near one comes to the first, in place and in height.
double ReturnsWithin(const std::vector<Pose>& poses) {
  double nearest = 1e9;
  for (std::size_t i = poses.size() - 20; i < poses.size(); ++i) {
    nearest = std::min(nearest, (poses[i].translation() - poses[0].translation()).norm());
  }
  return nearest;
}

TEST(WorldsTest, LoopsComeBackToTheirStart) {
  const World bridge = BridgeWorld();
  const std::vector<Pose> eight = DriveOf(bridge, "eight");
  EXPECT_LT(ReturnsWithin(eight), 1.0);
  EXPECT_NEAR(HighestSensor(eight), 3.4 + 1.2, 0.01);
  EXPECT_TRUE(std::any_of(eight.begin(), eight.end(), [](const Pose& T) {
    return T.translation().head<2>().norm() < 0.6 && T.translation().z() < 1.3;
  })) << "passes under the deck";
  const std::vector<Pose> parking = DriveOf(CarParkWorld(), "loop");
  EXPECT_LT(ReturnsWithin(parking), 1.0);
  EXPECT_NEAR(HighestSensor(parking), 3.2 + 1.2, 0.05);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const World campus = CampusLoopWorld(seed);
    ExpectPlacesOnSurfaces(campus);
    ExpectDrivesAreFree(campus);
    const std::vector<Pose> loop = DriveOf(campus, "loop");
    EXPECT_LT(ReturnsWithin(loop), 1.5) << seed;
    EXPECT_NEAR(static_cast<double>(loop.size()), 310.0, 5.0) << seed;
  }
}

TEST(WorldsTest, BuildingsCanBeDrivenRound) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const World world = BuildingWorld(seed);
    ExpectPlacesOnSurfaces(world);
    ExpectDrivesAreFree(world);
    const std::vector<Pose> round = DriveOf(world, "round");
    EXPECT_LT(ReturnsWithin(round), 2.0) << seed;
    EXPECT_NEAR(static_cast<double>(round.size()), 160.0, 40.0) << seed;
    EXPECT_EQ(world.scene.Labels(),
              (std::set<std::uint16_t>{kGround, kWall, kWindow, kStairs, kVegetation, kPole}));
  }
}

TEST(WorldsTest, RoomsCanBeDrivenThroughAndTheirWallsAreAsThickAsAskedFor) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const double wall_m = seed % 2 == 0 ? 0.08 : 0.15;
    const World world = RoomsWorld(wall_m, seed);
    ExpectPlacesOnSurfaces(world);
    ExpectDrivesAreFree(world);
    const Vector3d room = world.places.at("room0");
    for (const int axis : {0, 1}) {  // seen from both sides, above all things
      Vector3d from(room.x(), room.y(), 2.6);
      const double near = world.scene.Cast(from, Vector3d::Unit(axis), 50).value();
      EXPECT_NEAR(from[axis] + near, -0.5 * wall_m, 1e-9);
      from[axis] = 3.0;
      const double far = world.scene.Cast(from, -Vector3d::Unit(axis), 50).value();
      EXPECT_NEAR(from[axis] - far, 0.5 * wall_m, 1e-9);
    }
  }
}

// Where a labelled scan of the first building says windows are, and of what else there is much.
TEST(WorldsTest, WhatABuildingIsMadeOfIsSeenFromItsRound) {
  const World world = BuildingWorld(1);
  struct Seen {
    int points = 0;
    double lowest = 1e9, highest = -1e9;
  };
  std::map<std::uint16_t, Seen> seen;
  const std::vector<Pose> round = DriveOf(world, "round");
  SensorOptions sensor;
  sensor.labelled = true;
  for (std::size_t i = 0; i < round.size(); i += 10) {
    const PointCloud cloud = SimulateScan(world.scene, sensor, round[i], i);
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      const double z = (round[i] * cloud.points[k].cast<double>()).z();
      Seen& of_class = seen[cloud.label[k]];
      ++of_class.points;
      of_class.lowest = std::min(of_class.lowest, z);
      of_class.highest = std::max(of_class.highest, z);
    }
  }
  EXPECT_LT(seen[kGround].highest, 0.1);
  EXPECT_GT(seen[kWindow].lowest, 0.8);
  EXPECT_LT(seen[kStairs].highest, 0.9);
  EXPECT_EQ(seen.count(0), 0U);
  for (const WorldClass c : {kGround, kWall, kWindow, kStairs, kVegetation, kPole}) {
    EXPECT_GT(seen[c].points, 300) << ToString(c);
  }
}

TEST(WorldsTest, AScanSeesTheDeckFromBothSides) {
  const World world = BridgeWorld();
  const auto count_near = [&](const char* robot, double z) {
    const std::vector<Pose> poses = DriveOf(world, robot);
    const Pose& T = poses[poses.size() / 2];
    int count = 0;
    for (const Eigen::Vector3f& p : SimulateScan(world.scene, {}, T, 4).points) {
      const Vector3d p_world = T * p.cast<double>();
      if (p_world.head<2>().norm() < 4.0 && std::abs(p_world.z() - z) < 0.05) ++count;
    }
    return count;
  };
  EXPECT_GT(count_near("over", 3.4), 1000);
  EXPECT_EQ(count_near("over", 3.0), 0);
  EXPECT_GT(count_near("under", 3.0), 150);
  EXPECT_GT(count_near("under", 0.0), 1000);
}

}  // namespace
}  // namespace strata::testing
