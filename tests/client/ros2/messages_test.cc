#include "client/ros2/messages.h"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::ros2 {
namespace {

TEST(MessagesTest, CellsAreThoseOfNav2) {
  OccupancyGrid grid;
  grid.width = 4;
  grid.height = 1;
  grid.cells = {GridCell::kFree, GridCell::kOccupied, GridCell::kUnknown, GridCell::kGround};
  EXPECT_THAT(OccupancyOf(grid), ::testing::ElementsAre(0, 100, -1, -1));
}

TEST(MessagesTest, ASurfaceIsAPointInTheMiddleOfItsCell) {
  SurfaceTile tile;
  tile.key = {.x = -1, .y = 0};
  Surface surface;
  surface.cell = 0;  // the lowest x and y
  surface.z_m = 1.5F;
  surface.class_id = 3;
  surface.traversability = Traversability::kTraversable;
  surface.colour = {.r = 1, .g = 2, .b = 3};
  tile.surfaces = {surface};
  const std::string bytes = SurfaceBytes({tile}, 0.2);
  ASSERT_EQ(bytes.size(), kSurfaceBytes);
  float place[3];
  std::uint32_t rgb = 0;
  std::memcpy(place, bytes.data(), sizeof(place));
  std::memcpy(&rgb, bytes.data() + 12, sizeof(rgb));
  EXPECT_FLOAT_EQ(place[0], -256 * 0.2F + 0.1F);
  EXPECT_FLOAT_EQ(place[1], 0.1F);
  EXPECT_FLOAT_EQ(place[2], 1.5F);
  EXPECT_EQ(rgb, 0x010203U);
  EXPECT_EQ(bytes[16], 3);
  EXPECT_EQ(bytes[17], 1);
}

// Beside what happens to the base when the scan's pose takes small steps.
TEST(MessagesTest, ACovarianceIsOfTheBaseInTheMapsAxes) {
  const auto turned = [](double angle, const Eigen::Vector3d& axis) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
  };
  const Pose T_map_scan = MakePose(turned(2.0, {0.1, -0.3, 1.0}), {30.0, -7.0, 2.0});
  const Pose T_base_scan = MakePose(turned(0.8, {1.0, 0.5, 0.2}), {0.4, -0.2, 1.2});
  Matrix6d half = Matrix6d::Identity();
  for (int i = 0; i < 36; ++i) half(i / 6, i % 6) += 0.1 * std::sin(1.7 * i);
  const Matrix6d covariance = 1e-4 * half * half.transpose();
  const Pose T_map_base = T_map_scan * T_base_scan.inverse();
  Matrix6d J;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6d step = kStep * Vector6d::Unit(i);
    const Pose moved = Retract(T_map_scan, step) * T_base_scan.inverse();
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(moved.rotation() * T_map_base.rotation().transpose()));
    J.col(i) << (moved.translation() - T_map_base.translation()) / kStep,
        turn.angle() * turn.axis() / kStep;
  }
  const Matrix6d expected = J * covariance * J.transpose();
  EXPECT_TRUE(RosCovariance(T_map_scan, covariance, T_base_scan).isApprox(expected, 1e-4));
}

}  // namespace
}  // namespace strata::ros2
