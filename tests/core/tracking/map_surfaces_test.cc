#include "core/tracking/map_surfaces.h"

#include <cstddef>
#include <utility>

#include <gtest/gtest.h>

namespace strata {
namespace {

Surface At(int x, int y, float z_m, float depth_m = 0.0F) {
  Surface surface;
  surface.cell = CellInTile({x, y});
  surface.z_m = z_m;
  surface.depth_m = depth_m;
  return surface;
}

TEST(MapSurfacesTest, SurfacesAreFeaturesOfTheirClass) {
  SurfaceTile tile;
  tile.key = {0, 1, -1};  // from (256, −256)
  tile.surfaces = {At(0, 0, 1.5F), At(3, 0, 4.0F, 2.0F), At(4, 0, 3.0F)};
  tile.surfaces[2].traversability = Traversability::kUnderside;
  const Eigen::Vector3d centre(30.0, -20.0, 1.0);
  MapSurfacesCollector collector(centre, 0.1, true);
  EXPECT_TRUE(collector.Add(tile));
  const MapSurfaces surfaces = std::move(collector).Finish();
  const auto& tops = surfaces.features.points(FeatureClass::kTraversable);
  ASSERT_EQ(tops.size(), 1U);
  EXPECT_TRUE(tops[0].isApprox(Eigen::Vector3f(25.65F - 30.0F, -25.55F + 20.0F, 0.5F), 1e-5F));
  const auto& undersides = surfaces.features.points(FeatureClass::kNonTraversable);
  ASSERT_EQ(undersides.size(), 1U);
  EXPECT_NEAR(undersides[0].z(), 2.0F, 1e-6F);
  // Four points a metre, evenly from the bottom to the top.
  const auto& walls = surfaces.features.points(FeatureClass::kVertical);
  ASSERT_EQ(walls.size(), 8U);
  float sum = 0.0F;
  for (const Eigen::Vector3f& p : walls) sum += p.z();
  EXPECT_NEAR(sum / 8.0F, 2.0F, 1e-5F);  // the middle of 2 to 4 m, less 1
  EXPECT_EQ(surfaces.target.size(), surfaces.features.size());
  EXPECT_TRUE(surfaces.target.sensors().empty());
}

TEST(MapSurfacesTest, OverviewsHaveWiderCells) {
  SurfaceTile tile;
  tile.key = {2, 0, 0};
  tile.surfaces = {At(10, 0, 0.0F)};
  MapSurfacesCollector collector(Eigen::Vector3d::Zero(), 0.025, true);
  EXPECT_TRUE(collector.Add(tile));
  const MapSurfaces surfaces = std::move(collector).Finish();
  EXPECT_NEAR(surfaces.features.points(FeatureClass::kTraversable).at(0).x(), 1.05F, 1e-5F);
  EXPECT_NEAR(surfaces.blur_m, 0.1, 1e-12);
}

TEST(MapSurfacesTest, WhatIsFarIsLeftOutAndMemoryIsBounded) {
  SurfaceTile tile;
  tile.surfaces = {At(0, 0, 0.0F)};
  MapSurfacesCollector far(
      Eigen::Vector3d(kTrackedRangeM + kSurfacesSlackM + 1.0, 0.0, 0.0), 0.1, true);
  EXPECT_TRUE(far.Add(tile));
  EXPECT_EQ(std::move(far).Finish().features.size(), 0U);
  // A tower 32 km tall is 400 points, and the number of towers ends somewhere.
  tile.surfaces.clear();
  for (int i = 0; i < 256; ++i) tile.surfaces.push_back(At(i, 0, 32000.0F, 32000.0F));
  MapSurfacesCollector towers(Eigen::Vector3d::Zero(), 0.1, false);
  int tiles = 0;
  while (towers.Add(tile)) ++tiles;
  const MapSurfaces surfaces = std::move(towers).Finish();
  EXPECT_GT(tiles, 10);
  EXPECT_LT(surfaces.features.size(), MapSurfacesCollector::kMost + 400);
}

}  // namespace
}  // namespace strata
