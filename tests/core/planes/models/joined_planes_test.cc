#include "core/planes/models/joined_planes.h"

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "core/planes/moments.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

// Across x at `x`, 4 by 2.5 m, turned by `slope` about z, points spread by 1 cm.
JoinedPlane JoinedWall(double x, double slope, double area_m2) {
  const Eigen::Vector3d mean(x, 0.0, 1.25);
  const Eigen::Vector3d along = Eigen::Vector3d(slope, 1.0, 0.0).normalized();
  const Eigen::Vector3d normal(along.y(), -along.x(), 0.0);
  const Eigen::Matrix3d spread = 16.0 / 12.0 * along * along.transpose() +
                                 1e-4 * normal * normal.transpose() +
                                 0.5 * Eigen::Vector3d::UnitZ() * Eigen::RowVector3d::UnitZ();
  JoinedPlane wall;
  wall.sum.moments = MomentsOf(area_m2, mean, spread);
  wall.sum.plane = {normal, normal.dot(mean)};
  wall.sum.voxels = {VoxelOf(mean)};
  wall.sum.measurements = 8.0 * area_m2;
  wall.sum.information = wall.sum.measurements / 4e-4;
  wall.sum.point_count = 1000;
  wall.model.plane = wall.sum.plane;
  wall.model.area_m2 = area_m2;
  wall.model.rms_m = 0.01;
  return wall;
}

double PlaceWith(JoinedPlane other) {
  JoinedPlanes joined;
  joined.planes = {JoinedWall(5.0, 0.0, 10.0), std::move(other)};
  const std::vector<std::size_t> owners = {0, 0};
  const auto with = WithOwned(std::move(joined), owners, PlaneModelOptions(), Stop());
  STRATA_EXPECT_OK(with.status());
  if (!with.ok() || with->planes.size() != 1) return 0.0;
  return std::abs(with->planes[0].model.plane.distance);
}

TEST(WithOwned, WhatIsNearCountsForThePlaneOfItsOwner) {
  EXPECT_NEAR(PlaceWith(JoinedWall(5.03, 0.0, 5.0)), 5.01, 1e-3);
}

// Through both faces of a wall of 13 cm.
TEST(WithOwned, WhatHoldsStripsOfTwoFacesMovesNeither) {
  EXPECT_NEAR(PlaceWith(JoinedWall(5.064, 0.1, 4.0)), 5.0, 1e-6);
}

}  // namespace
}  // namespace strata
