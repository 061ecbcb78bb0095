#include "core/registration/clouds/leveling.h"

#include <cmath>
#include <cstdint>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

// A floor 20 m wide at z = −1.5, four walls and clutter, seen by a sensor turned by R_scan_level.
PointCloud Room(const Eigen::Matrix3d& R_scan_level, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> wide(-10.0, 10.0);
  std::uniform_real_distribution<double> tall(-1.5, 3.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  PointCloud cloud;
  const auto add = [&](double x, double y, double z) {
    cloud.points.push_back((R_scan_level * Eigen::Vector3d(x, y, z)).cast<float>());
  };
  for (int i = 0; i < 6000; ++i) add(wide(random), wide(random), -1.5 + noise(random));
  for (int i = 0; i < 8000; ++i) {
    const double side = i % 2 == 0 ? 10.0 : -10.0;
    if (i % 4 < 2) {
      add(side + noise(random), wide(random), tall(random));
    } else {
      add(wide(random), side + noise(random), tall(random));
    }
  }
  for (int i = 0; i < 2000; ++i) add(wide(random), wide(random), tall(random));
  return cloud;
}

TEST(LevelByFloorTest, PlantedTiltIsFound) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    SCOPED_TRACE(seed);
    const double tilt = 0.06 * static_cast<double>(seed);
    const Eigen::Matrix3d R_scan_level =
        So3Exp(tilt * Eigen::Vector3d(std::cos(seed), std::sin(seed), 0.0));
    STRATA_ASSERT_OK_AND_ASSIGN(const Leveling leveling, LevelByFloor(Room(R_scan_level, seed)));
    EXPECT_NEAR(leveling.tilt_rad, tilt, 0.002);
    EXPECT_TRUE((leveling.R_level_scan * R_scan_level).isIdentity(0.003));
    EXPECT_NEAR(leveling.floor_z_m, -1.5, 0.01);
    EXPECT_GT(leveling.support, 0.2);
  }
}

TEST(LevelByFloorTest, OnlyWallsIsNotFound) {
  LevelingOptions options;
  options.max_tilt_rad = 0.3;
  PointCloud wall;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<float> wide(-10.0F, 10.0F);
  for (int i = 0; i < 5000; ++i) wall.points.emplace_back(wide(random), 3.0F, wide(random));
  EXPECT_THAT(LevelByFloor(wall, options),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no floor")));
  EXPECT_THAT(LevelByFloor(PointCloud(), options),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no floor")));
}

TEST(LevelByFloorTest, InvalidOptionsAreNamed) {
  LevelingOptions options;
  options.thickness_m = 0.0;
  EXPECT_THAT(LevelByFloor(PointCloud(), options),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("thickness_m is 0")));
}

TEST(LevelByFloorTest, RecordedHallIsTiltedByItsKnownNormal) {
  STRATA_REQUIRE_DATA(path, "hall_livox_loop");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto poses,
                              testing::ReadIndexedPoses(path / "poses_reference.txt"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud,
                              testing::ReadBinaryPcd(path / "scans" / "scan000.pcd"));
  STRATA_ASSERT_OK_AND_ASSIGN(const Leveling leveling, LevelByFloor(cloud));
  const Eigen::Vector3d up_world = poses.at(0).T_world_scan.linear() *
                                   leveling.R_level_scan.transpose() * Eigen::Vector3d::UnitZ();
  // From the data set's README.
  const Eigen::Vector3d floor_normal = Eigen::Vector3d(-0.0472, 0.0066, 0.9989).normalized();
  EXPECT_LT(std::acos(up_world.dot(floor_normal)), 0.01);
  EXPECT_NEAR(leveling.tilt_rad, 2.7 * M_PI / 180.0, 0.01);
}

}  // namespace
}  // namespace strata
