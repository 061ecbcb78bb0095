#include "core/mls/surface_tile.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

Patch At(std::uint16_t cell, double z_m) {
  return PatchOfMeasurement(cell, static_cast<int>(z_m * kTicksPerMetre), SigmaCode(0.01));
}

TEST(SurfaceTileTest, SurfacesHaveTheValuesOfTheirPatches) {
  const MlsParameters parameters;
  MlsTile tile;
  tile.key = {0, -3, 8};
  tile.patches = {Join(At(5, 1.0), At(5, 1.05), parameters),
                  Join(At(5, 3.0), At(5, 3.5), parameters),
                  At(700, -2.0)};
  tile.IndexRows();
  const SurfaceTile surfaces = SurfacesOf(tile);
  EXPECT_EQ(surfaces.key, tile.key);
  EXPECT_EQ(surfaces.version, 0U);
  ASSERT_EQ(surfaces.surfaces.size(), 3U);
  EXPECT_NEAR(surfaces.surfaces[0].z_m, 1.025, 3e-4);
  EXPECT_NEAR(surfaces.surfaces[0].sigma_m, SigmaOfCode(SigmaCode(0.01)) / std::sqrt(2.0), 1e-4);
  EXPECT_FALSE(surfaces.surfaces[0].vertical());
  EXPECT_NEAR(surfaces.surfaces[1].z_m, 3.5, 3e-4);
  EXPECT_TRUE(surfaces.surfaces[1].vertical());
  EXPECT_NEAR(surfaces.surfaces[1].bottom_m(), 3.0, 3e-4);
  EXPECT_EQ(surfaces.surfaces[2].cell, 700);
  EXPECT_EQ(surfaces.surfaces[2].traversability, Traversability::kUnknown);
  EXPECT_EQ(surfaces.surfaces[2].cost, 0.0F);
}

TEST(SurfaceTileTest, ColoursAreTheMeansOfWhatHadOneAndBlackIsAColour) {
  MlsTile tile;
  tile.patches = {At(0, 0.0), At(1, 0.0), At(2, 0.0)};
  tile.colour = {{.r = 300, .g = 3, .b = 5, .count = 2}, {.count = 4}, {}};
  tile.IndexRows();
  const std::vector<Surface> surfaces = SurfacesOf(tile).surfaces;
  EXPECT_EQ(surfaces[0].colour, (Colour{.r = 150, .g = 2, .b = 3}));
  EXPECT_EQ(surfaces[1].colour, (Colour{.r = 1, .g = 1, .b = 1}));
  EXPECT_TRUE(surfaces[1].coloured());
  EXPECT_FALSE(surfaces[2].coloured());
}

TEST(SurfaceTileTest, ClassOfMostVotesAndOfTheSmallerIdOnATie) {
  MlsTile tile;
  tile.patches = {At(0, 0.0), At(1, 0.0), At(2, 0.0), At(3, 0.0)};
  tile.votes = {{0, 4, 10}, {0, 9, 11}, {1, 2, 5}, {1, 3, 5}, {3, 7, 1}};
  tile.IndexRows();
  const std::vector<Surface> surfaces = SurfacesOf(tile).surfaces;
  EXPECT_EQ(surfaces[0].class_id, 9);
  EXPECT_EQ(surfaces[1].class_id, 2);
  EXPECT_EQ(surfaces[2].class_id, 0);
  EXPECT_EQ(surfaces[3].class_id, 7);
}

TEST(SurfaceTileTest, ConfidenceIsTheShareOfTheVotesInPercent) {
  MlsTile tile;
  for (std::uint16_t cell = 0; cell < 6; ++cell) tile.patches.push_back(At(cell, 0.0));
  constexpr std::uint32_t kMany = 4'000'000'000;
  tile.votes = {{0, 4, 1}, {0, 9, 2}, {1, 5, 7}, {2, 1, kMany}, {2, 2, kMany}, {3, 300, 9}};
  tile.votes.push_back({4, 3, 1});
  tile.votes.push_back({4, 300, 9});  // of no class
  for (std::uint16_t id = 1; id <= 250; ++id) tile.votes.push_back({5, id, 1});
  tile.IndexRows();
  const std::vector<Surface> surfaces = SurfacesOf(tile).surfaces;
  EXPECT_EQ(surfaces[0].confidence, 67);
  EXPECT_EQ(surfaces[1].confidence, 100);
  EXPECT_EQ(surfaces[2].confidence, 50);
  EXPECT_EQ(surfaces[3].class_id, 0);
  EXPECT_EQ(surfaces[3].confidence, 0);
  EXPECT_EQ(surfaces[4].class_id, 3);
  EXPECT_EQ(surfaces[4].confidence, 100);
  EXPECT_EQ(surfaces[5].confidence, 1);  // of 0.4 %
}

TEST(SurfaceTileTest, CellFindsItsSurfacesAndOnlyThose) {
  std::mt19937 random(3);
  SurfaceTile tile;
  std::vector<std::size_t> count(std::size_t{kTileCells} * kTileCells);
  for (std::size_t cell = 0; cell < count.size(); ++cell) {
    count[cell] = random() % 7 == 0 ? random() % 4 : 0;
    for (std::size_t i = 0; i < count[cell]; ++i) {
      tile.surfaces.push_back(
          {.cell = static_cast<std::uint16_t>(cell), .z_m = static_cast<float>(i)});
    }
  }
  tile.IndexRows();
  EXPECT_EQ(tile.row_begin.back(), tile.surfaces.size());
  for (std::size_t cell = 0; cell < count.size(); ++cell) {
    const auto found = tile.Cell(static_cast<std::uint16_t>(cell));
    ASSERT_EQ(found.size(), count[cell]) << cell;
    for (const Surface& surface : found) ASSERT_EQ(surface.cell, cell);
  }
}

}  // namespace
}  // namespace strata
