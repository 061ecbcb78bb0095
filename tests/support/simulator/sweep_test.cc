// The oracle for paths must itself find every kind of trouble.
#include "tests/support/simulator/sweep.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

std::string Found(const World& world, const std::vector<Vector3d>& path, double height_m = 1.0) {
  RobotProfile profile;
  profile.height_m = height_m;
  return Sweep(world.scene, path, profile).collision;
}

TEST(SweepTest, FreePathsAreFree) {
  for (const bool parapets : {true, false}) {
    const World bridge = BridgeWorld({.parapets = parapets});
    EXPECT_EQ(Found(bridge, {{-26, 0, 0}, {-6, 0, 3.4}, {6, 0, 3.4}, {26, 0, 0}}), "");
    EXPECT_EQ(Found(bridge, {{0, -15, 0}, {0, 15, 0}}, 2.9), "");
  }
  const World car_park = CarParkWorld();
  EXPECT_EQ(Found(car_park, {{-9.5, 0, 0}, {9.5, 0, 3.2}}), "");
}

TEST(SweepTest, EveryKindOfTroubleIsFound) {
  const World open = BridgeWorld({.parapets = false});
  const World walled = BridgeWorld();
  EXPECT_THAT(Found(open, {{0, 0, 3.4}, {0, 1.9, 3.4}}), HasSubstr("drop of 3.40 m"));
  EXPECT_THAT(Found(open, {{0, 0, 3.4}, {0, 4, 0}}), HasSubstr("drop of"));
  EXPECT_THAT(Found(open, {{0, 0, 3.4}, {3, 0, 0}}), HasSubstr("waypoint off the ground"));
  EXPECT_THAT(Found(open, {{0, 0, 0}, {0, 1, 0}}, 3.2), HasSubstr("clearance of 3.00 m"));
  EXPECT_THAT(Found(open, {{0, -15, 0}, {0, 15, 0}}, 3.2), HasSubstr("obstacle"));
  EXPECT_THAT(Found(walled, {{0, 0, 3.4}, {0, 1.7, 3.4}}), HasSubstr("obstacle"));
  EXPECT_THAT(Found(walled, {{-10, -10, 0}, {-10, 10, 0}}), HasSubstr("obstacle"));
  EXPECT_THAT(Found(walled, {{-10, -18, 0}, {-10, -10, 0}}), HasSubstr("inside a solid"));
}

}  // namespace
}  // namespace strata::testing
