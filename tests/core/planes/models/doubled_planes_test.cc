#include "core/planes/models/doubled_planes.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_raster.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

using ::testing::ElementsAre;

// Around (0, 0, 2) across x, turned about z; hits in each square of 0.0625 m from -half to half.
FacedPlane WallAt(double x, double turn_rad, double half_m, std::uint32_t hits) {
  const Eigen::Vector3d normal(std::cos(turn_rad), std::sin(turn_rad), 0.0);
  const Eigen::Vector3d middle(x, 0.0, 2.0);
  const Plane plane{normal, normal.dot(middle)};
  FacedPlane wall{.seen = {plane, FrameOf(plane, middle), PlaneRaster(0.0625, 0.125), {}},
                  .band_m = 0.12,
                  .facing = 1000};
  for (double u = -half_m + 0.03; u < half_m; u += 0.0625) {
    for (double v = -1.5; v < 1.5; v += 0.0625) {
      wall.seen.raster.AddHits({u, v}, hits);
      wall.seen.box.extend(wall.seen.frame.Lift({u, v}));
    }
  }
  wall.seen.box.extend(wall.seen.box.min() - Eigen::Vector3d::Constant(1.0));
  const Eigen::Vector3d& across = wall.seen.frame.axis_u;
  const Eigen::Matrix3d spread = half_m * half_m / 3.0 * across * across.transpose() +
                                 0.75 * Eigen::Vector3d::UnitZ() * Eigen::RowVector3d::UnitZ();
  wall.moments = MomentsOf(6.0 * half_m, middle, spread);
  return wall;
}

TEST(OwnersOf, WhatCrossesAWallIsTheWalls) {
  const std::vector<FacedPlane> planes = {WallAt(5.0, 0.0, 8.0, 20), WallAt(5.01, 0.012, 5.0, 3)};
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 0));
}

TEST(OwnersOf, OfTwoInOnePlaceThatFaceEachOtherBothStay) {
  std::vector<FacedPlane> planes = {WallAt(5.0, 0.0, 8.0, 20), WallAt(5.05, 0.0, 5.0, 20)};
  planes[1].facing = -planes[1].facing;
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 1));
  // The same with its normal turned round, too, is on the same side.
  Plane& plane = planes[1].seen.plane;
  plane = {-plane.normal, -plane.distance};
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 0));
}

// Thesis 5.5: a picture on a wall, where colours count.
TEST(OwnersOf, WhatHasAnotherColourStays) {
  std::vector<FacedPlane> planes = {WallAt(5.0, 0.0, 8.0, 20), WallAt(5.01, 0.012, 5.0, 3)};
  planes[0].colour = LabOf({250, 250, 250});
  planes[1].colour = LabOf({200, 20, 20});
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 1));
  planes[1].colour = LabOf({240, 240, 235});
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 0));
}

TEST(OwnersOf, WhatHidesTheWallStays) {
  std::vector<FacedPlane> planes = {WallAt(5.0, 0.0, 8.0, 0), WallAt(4.95, 0.0, 1.0, 20)};
  for (double u = -7.97; u < 8.0; u += 0.0625) {
    if (std::abs(u) < 1.0) continue;
    for (double v = -1.5; v < 1.5; v += 0.0625) planes[0].seen.raster.AddHits({u, v}, 20);
  }
  EXPECT_THAT(OwnersOf(planes), ElementsAre(0, 1));
}

TEST(AddSeen, BringsHitsToTheirPlaces) {
  FacedPlane wall = WallAt(5.0, 0.0, 1.0, 1);
  const FacedPlane other = WallAt(5.02, 0.01, 2.0, 1);
  const auto hits = [](const PlaneRaster& raster) {
    std::uint64_t sum = 0;
    Eigen::AlignedBox2d box;
    raster.ForEachSquare([&](const Eigen::Vector2d& at, std::uint32_t count) {
      sum += count;
      box.extend(at);
    });
    return std::pair(sum, box.sizes().x());
  };
  const auto before = hits(wall.seen.raster);
  AddSeen(other, wall);
  const auto after = hits(wall.seen.raster);
  EXPECT_EQ(after.first, before.first + hits(other.seen.raster).first);
  EXPECT_NEAR(after.second, 4.0, 0.1);
}

}  // namespace
}  // namespace strata
