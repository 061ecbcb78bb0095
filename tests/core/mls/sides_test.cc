#include "core/mls/sides.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "core/mls/join.h"
#include "core/mls/patch.h"

namespace strata {
namespace {

constexpr std::uint64_t kAbove = Patch::kSeenFromAbove;
constexpr std::uint64_t kBelow = Patch::kSeenFromBelow;

// A square of 6 m around (0, 0) with a point every `spacing_m` and 5 mm of noise; z of (x, y).
template <typename Height>
void AddSquare(Height z, double spacing_m, PointCloud& cloud) {
  std::mt19937_64 random(cloud.size() + 1);
  std::normal_distribution<double> noise(0.0, 0.005);
  for (double y = -3.0; y < 3.0; y += spacing_m) {
    for (double x = -3.0; x < 3.0; x += spacing_m) {
      cloud.points.push_back(Eigen::Vector3d(x, y, z(x, y) + noise(random)).cast<float>());
    }
  }
}

PointCloud Floor() {
  PointCloud cloud;
  AddSquare([](double, double) { return 0.0; }, 0.1, cloud);
  return cloud;
}

MlsMap Marked(const PointCloud& cloud,
              const Eigen::Vector3d& p_sensor,
              const Pose& T_map_scan = Pose::Identity()) {
  MlsMap map = BuildMlsMap(cloud, T_map_scan, {}, {}).value().map;
  MarkSides(T_map_scan * p_sensor, map);
  return map;
}

struct Counts {
  int above = 0, below = 0, both = 0, unknown = 0;
};

Counts CountSides(const MlsMap& map) {
  Counts counts;
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      ++(patch.sides == 0        ? counts.unknown
         : patch.sides == kAbove ? counts.above
         : patch.sides == kBelow ? counts.below
                                 : counts.both);
    }
  }
  return counts;
}

TEST(SidesTest, AFloorIsSeenFromAboveAndACeilingFromBelow) {
  for (const double height : {2.5, 1.6, 8.0}) {
    SCOPED_TRACE(height);
    PointCloud room = Floor();
    const std::size_t floor = BuildMlsMap(room, Pose::Identity(), {}, {}).value().map.patch_count();
    AddSquare([&](double, double) { return height; }, 0.1, room);
    const Eigen::Vector3d p_sensor(0.3, -0.4, 1.1);
    // The frame of the map is anywhere, turned, and far from its origin.
    const Pose T_map_scan = Eigen::Translation3d(1234.5, -777.7, 50.25) *
                            Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
    for (const MlsMap& map : {Marked(room, p_sensor), Marked(room, p_sensor, T_map_scan)}) {
      const Counts counts = CountSides(map);
      EXPECT_EQ(counts.both + counts.unknown, 0);
      EXPECT_EQ(counts.above + counts.below, static_cast<int>(map.patch_count()));
      EXPECT_NEAR(counts.above, counts.below, 0.05 * static_cast<double>(floor));
    }
  }
}

TEST(SidesTest, WhatIsHigherThanTheSensorButNoCeilingIsATop) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  PointCloud hill = Floor();  // 35°, the sensor at its foot
  AddSquare([](double x, double) { return 3.0 + 0.7 * x; }, 0.1, hill);
  PointCloud leaves = Floor();
  AddSquare([&](double, double) { return 3.0 + 0.8 * uniform(random); }, 0.1, leaves);
  for (const PointCloud& cloud : {hill, leaves}) {
    const Counts counts = CountSides(Marked(cloud, {-4.0, 0.0, 0.5}));
    EXPECT_GT(counts.above, 1000);
    EXPECT_LT(counts.below, counts.above / 50);
  }
}

TEST(SidesTest, FewPointsAsHighAsACeilingAreDoubtfulAndCountAsUndersides) {
  PointCloud sparse = Floor();
  const std::size_t ceiling = sparse.size();
  AddSquare([](double, double) { return 2.5; }, 0.1, sparse);
  for (int i = 0; i < 20; ++i) {                                             // one in a cube
    sparse.points.emplace_back(5.05F + static_cast<float>(i), 0.5F, 2.5F);   // of the ceiling
    sparse.points.emplace_back(5.05F + static_cast<float>(i), 20.5F, 6.0F);  // of anything
    sparse.points.emplace_back(5.05F + static_cast<float>(i), 1.0F, 0.0F);
  }
  const MlsMap map = BuildMlsMap(sparse, Pose::Identity(), {}, {}).value().map;
  int doubtful = 0;
  int unknown = 0;
  for (const Side side : SidesOf(map, {0.0, 0.0, 1.0})) {
    doubtful += side == Side::kDoubtful;
    unknown += side == Side::kUnknown;
  }
  EXPECT_EQ(doubtful, 20);
  EXPECT_EQ(unknown, 20);
  const Counts counts = CountSides(Marked(sparse, {0.0, 0.0, 1.0}));
  EXPECT_EQ(counts.unknown, 20);
  EXPECT_GT(counts.below, static_cast<int>(ceiling) * 9 / 10);
}

// A robot on a ramp looks up to what lies below its own horizon.
TEST(SidesTest, AScanTakenOnARampKnowsACeilingByTheVertical) {
  const Eigen::Matrix3d R_scan_map(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()));
  const auto undersides = [&](double ceiling_m, const Eigen::Vector3d& up) {
    PointCloud room;
    AddSquare([&](double, double) { return ceiling_m; }, 0.1, room);
    for (Eigen::Vector3f& p : room.points) p = R_scan_map.cast<float>() * p;
    const MlsMap map = BuildMlsMap(room, Pose::Identity(), {}, {}).value().map;
    const Eigen::Vector3d p_sensor = R_scan_map * Eigen::Vector3d(-2.5, 0.3, 2.0);
    const std::vector<Side> sides = SidesOf(map, p_sensor, 100.0, up);
    const auto count = std::count(sides.begin(), sides.end(), Side::kUnderside);
    return static_cast<double>(count) / static_cast<double>(sides.size());
  };
  const Eigen::Vector3d up = R_scan_map * Eigen::Vector3d::UnitZ();
  EXPECT_GT(undersides(2.5, up), 0.95);
  EXPECT_LT(undersides(2.5, Eigen::Vector3d::UnitZ()), 0.6);  // so it can tell
  EXPECT_EQ(undersides(0.0, up), 0.0);                        // a floor
}

// A deck of 0.2 m, seen from below by one scan and from above by the other.
TEST(SidesTest, JoinedScansHaveSeenBothSides) {
  PointCloud under = Floor();
  const std::size_t floor = BuildMlsMap(under, Pose::Identity(), {}, {}).value().map.patch_count();
  AddSquare([](double, double) { return 2.0; }, 0.05, under);
  PointCloud over;
  AddSquare([](double, double) { return 2.2; }, 0.05, over);
  const MlsMap below = Marked(under, {0.0, 0.0, 1.0});
  const MlsMap above = Marked(over, {0.0, 0.0, 3.3});
  const auto deck = static_cast<int>(below.patch_count() - floor);
  EXPECT_EQ(CountSides(below).below, deck);
  EXPECT_EQ(CountSides(above).above, static_cast<int>(above.patch_count()));
  const MlsMap joined = JoinMaps(below, above);
  EXPECT_EQ(CountSides(joined).both, deck);
  EXPECT_EQ(joined, JoinMaps(above, below));
  const MlsMap moved = TransformContribution(below, Pose(Eigen::Translation3d(0.35, 0.0, 1.0)));
  EXPECT_NEAR(CountSides(moved).below, deck, 0.2 * deck);
  EXPECT_EQ(CountSides(moved).both + CountSides(moved).unknown, 0);
}

// The origin of what somebody merged, or of a terrain, is no sensor.
TEST(SidesTest, MergedCloudsHaveNoUndersides) {
  PointCloud terrain;  // rolling, a storey between its lowest and its highest place
  AddSquare([](double x, double y) { return 0.3 * x + 0.5 * std::sin(y); }, 0.1, terrain);
  PointCloud deck = Floor();
  AddSquare([](double, double) { return 3.0; }, 0.1, deck);
  for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, -1.5),    // its lowest corner
                                        Eigen::Vector3d(0, 0, 0.0),     // in the ground
                                        Eigen::Vector3d(0, 0, 1.5)}) {  // above
    EXPECT_EQ(CountSides(Marked(terrain, origin)).below, 0) << origin.transpose();
  }
  EXPECT_EQ(CountSides(Marked(deck, {0, 0, 0.0})).below, 0);  // on the ground itself
  EXPECT_GT(CountSides(Marked(deck, {0, 0, 1.0})).below, 1000);
}

}  // namespace
}  // namespace strata
