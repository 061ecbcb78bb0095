#include "core/mls/overview.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/mls_parameters.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "tests/core/mls/surface_world.h"

namespace strata {
namespace {

using testing::Draw;
using testing::FindTile;
using testing::Level;
using testing::SurfaceWorld;

// The next level of a world of one level.
SurfaceWorld Up(const SurfaceWorld& world, const MlsParameters& parameters = {}) {
  SurfaceWorld above;
  for (const auto& [key, tile] : world) {
    const TileKey parent = ParentOf(key);
    if (above.contains(parent)) continue;
    std::array<const SurfaceTile*, 4> children{};
    for (int i = 0; i < 4; ++i) children[i] = FindTile(world, ChildOf(parent, i));
    above[parent] = MakeOverviewTile(parent, children, parameters);
  }
  return above;
}

// One child of level 0 with the given surfaces in the child cells of the parent's cell (0, 0).
SurfaceTile Parent(std::vector<Surface> surfaces, const MlsParameters& parameters = {}) {
  SurfaceTile child;
  child.surfaces = std::move(surfaces);
  child.IndexRows();
  return MakeOverviewTile({1, 0, 0}, {&child, nullptr, nullptr, nullptr}, parameters);
}

constexpr std::uint16_t kRow =
    kTileCells;  // the child cells of parent cell 0: 0, 1, kRow, kRow + 1

TEST(OverviewTest, KeysGoUpAndDownForAnySign) {
  EXPECT_EQ(ParentOf({0, -1, 5}), (TileKey{1, -1, 2}));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(ParentOf(ChildOf({3, -7, 4}, i)), (TileKey{3, -7, 4}));
  EXPECT_EQ(ChildOf({1, -1, 0}, 1), (TileKey{0, -1, 0}));
  EXPECT_EQ(ChildOf({1, -1, 0}, 2), (TileKey{0, -2, 1}));
}

TEST(OverviewTest, MeanIsWeightedByPrecisionAndSigmaTellsTheSpread) {
  const SurfaceTile tile = Parent({{.cell = 0, .z_m = 1.0F, .sigma_m = 0.1F},
                                   {.cell = kRow + 1, .z_m = 1.5F, .sigma_m = 0.2F}});
  ASSERT_EQ(tile.surfaces.size(), 1U);
  // Weights 100 and 25: mean 1.1, variance 1/125 + (100·0.1² + 25·0.4²)/125.
  EXPECT_NEAR(tile.surfaces[0].z_m, 1.1, 1e-5);
  EXPECT_NEAR(tile.surfaces[0].sigma_m, std::sqrt(1.0 / 125.0 + 5.0 / 125.0), 1e-5);
  EXPECT_EQ(tile.surfaces[0].depth_m, 0.0F);
}

TEST(OverviewTest, ColourIsTheMeanOfThoseThatHaveOne) {
  const SurfaceTile tile =
      Parent({{.cell = 0, .colour = {.r = 10, .g = 20, .b = 30}, .sigma_m = 0.1F},
              {.cell = 1, .sigma_m = 0.1F},
              {.cell = kRow, .colour = {.r = 13, .g = 0, .b = 31}, .sigma_m = 0.1F}});
  ASSERT_EQ(tile.surfaces.size(), 1U);
  EXPECT_EQ(tile.surfaces[0].colour, (Colour{.r = 12, .g = 10, .b = 31}));
  EXPECT_FALSE(Parent({{.cell = 0, .sigma_m = 0.1F}}).surfaces[0].coloured());
}

// As full as a tile may be, with room for nothing else; of another child with one surface more.
TEST(OverviewTest, BeyondWhatATileHoldsEachCellKeepsItsHighest) {
  constexpr std::size_t kLayers = 4 * kOverviewLayers;
  SurfaceTile full;
  for (int cell = 0; cell < kTileCells * kTileCells; ++cell) {
    if (cell % 2 != 0 || cell / kTileCells % 2 != 0) continue;
    for (std::size_t layer = 0; layer < kLayers; ++layer) {
      full.surfaces.push_back({.cell = static_cast<std::uint16_t>(cell),
                               .z_m = 2.0F * static_cast<float>(layer),
                               .sigma_m = 0.01F});
    }
  }
  full.IndexRows();
  ASSERT_EQ(full.surfaces.size(), kMaxOverviewSurfaces);
  const SurfaceTile whole = MakeOverviewTile({1, 0, 0}, {&full, nullptr, nullptr, nullptr}, {});
  EXPECT_EQ(whole.surfaces.size(), kMaxOverviewSurfaces);

  SurfaceTile other;
  other.surfaces = {{.cell = 0, .z_m = 1.0F, .sigma_m = 0.01F}};
  other.IndexRows();
  const SurfaceTile cut = MakeOverviewTile({1, 0, 0}, {&full, &other, nullptr, nullptr}, {});
  EXPECT_EQ(cut.surfaces.size(), kMaxOverviewSurfaces / 4 + 1);
  const std::span<const Surface> cell = cut.Cell(0);
  ASSERT_EQ(cell.size(), kOverviewLayers);
  EXPECT_EQ(cell.front().z_m, 2.0F * static_cast<float>(kLayers - kOverviewLayers));
  EXPECT_EQ(cell.back().z_m, 2.0F * static_cast<float>(kLayers - 1));
  ASSERT_EQ(cut.Cell(kTileCells / 2).size(), 1U);
}

TEST(OverviewTest, TopsAGapApartStayTwoAndCloserOnesChain) {
  EXPECT_EQ(Parent({{.cell = 0, .z_m = 0.0F, .sigma_m = 0.01F},
                    {.cell = 1, .z_m = 1.0F, .sigma_m = 0.01F}})
                .surfaces.size(),
            2U);
  EXPECT_EQ(Parent({{.cell = 0, .z_m = 0.0F, .sigma_m = 0.01F},
                    {.cell = 1, .z_m = 0.9F, .sigma_m = 0.01F},
                    {.cell = kRow, .z_m = 1.8F, .sigma_m = 0.01F}})
                .surfaces.size(),
            1U);
}

TEST(OverviewTest, ChainWithTwoLevelsOfOneCellIsCutAtItsLargestGap) {
  // Ground 0 and slab 1.2 in one cell; a ramp of 0.3 and 0.8 beside: 0–0.3 and 0.8–1.2.
  const SurfaceTile tile = Parent({{.cell = 0, .z_m = 0.0F, .sigma_m = 0.01F},
                                   {.cell = 0, .z_m = 1.2F, .sigma_m = 0.01F},
                                   {.cell = 1, .z_m = 0.3F, .sigma_m = 0.01F},
                                   {.cell = kRow, .z_m = 0.8F, .sigma_m = 0.01F}});
  ASSERT_EQ(tile.surfaces.size(), 2U);
  EXPECT_NEAR(tile.surfaces[0].z_m, 0.15, 1e-6);
  EXPECT_NEAR(tile.surfaces[1].z_m, 1.0, 1e-6);
}

TEST(OverviewTest, WallKeepsItsFootAndAKerbInGroundIsLost) {
  const SurfaceTile wall = Parent({{.cell = 0, .z_m = 0.0F, .sigma_m = 0.01F},
                                   {.cell = 1, .z_m = 3.0F, .sigma_m = 0.01F, .depth_m = 3.1F},
                                   {.cell = kRow, .z_m = 2.8F, .sigma_m = 0.01F, .depth_m = 2.8F}});
  ASSERT_EQ(wall.surfaces.size(), 2U);
  EXPECT_FALSE(wall.surfaces[0].vertical());
  EXPECT_NEAR(wall.surfaces[1].z_m, 2.9, 1e-5);
  EXPECT_NEAR(wall.surfaces[1].bottom_m(), -0.1, 1e-5);
  const SurfaceTile kerb = Parent({{.cell = 0, .sigma_m = 0.01F},
                                   {.cell = 1, .z_m = 0.2F, .sigma_m = 0.01F, .depth_m = 0.2F},
                                   {.cell = kRow, .sigma_m = 0.01F}});
  ASSERT_EQ(kerb.surfaces.size(), 1U);
  EXPECT_FALSE(kerb.surfaces[0].vertical());
}

TEST(OverviewTest, ClassTraversabilityAndCostOfMost) {
  const auto make = [](std::uint16_t cell, std::uint8_t id, Traversability t, float cost) {
    return Surface{
        .cell = cell, .traversability = t, .class_id = id, .sigma_m = 0.01F, .cost = cost};
  };
  const auto yes = Traversability::kTraversable;
  const auto no = Traversability::kNonTraversable;
  const auto unknown = Traversability::kUnknown;
  const Surface most =
      Parent({make(0, 0, yes, 1), make(1, 7, yes, 2), make(kRow, 0, no, 6)}).surfaces[0];
  EXPECT_EQ(most.class_id, 7);
  EXPECT_EQ(most.traversability, yes);
  EXPECT_FLOAT_EQ(most.cost, 3.0F);
  const Surface tie =
      Parent({make(0, 9, yes, 0), make(1, 4, no, 0), make(kRow, 0, unknown, 0)}).surfaces[0];
  EXPECT_EQ(tie.class_id, 4);
  EXPECT_EQ(tie.traversability, no);
  EXPECT_EQ(Parent({make(0, 0, unknown, 0)}).surfaces[0].traversability, unknown);
}

TEST(OverviewTest, UndersidesAreThatUnlessAnythingElseIsAmongThem) {
  const auto make = [](std::uint16_t cell, Traversability t) {
    return Surface{.cell = cell, .traversability = t, .z_m = 2.0F, .sigma_m = 0.1F};
  };
  constexpr auto kUnderside = Traversability::kUnderside;
  const auto of = [&](Traversability other) {
    return Parent({make(0, kUnderside), make(1, kUnderside), make(kRow, other)})
        .surfaces.at(0)
        .traversability;
  };
  EXPECT_EQ(of(kUnderside), kUnderside);
  for (const Traversability other :
       {Traversability::kUnknown, Traversability::kTraversable, Traversability::kNonTraversable}) {
    EXPECT_EQ(of(other), other);
  }
}

TEST(OverviewTest, ConfidenceIsTheMeanOfTheClassAmongThoseWithAClass) {
  const auto make = [](std::uint16_t cell, std::uint8_t id, std::uint8_t confidence) {
    return Surface{.cell = cell, .class_id = id, .confidence = confidence, .sigma_m = 0.01F};
  };
  const Surface most =
      Parent({make(0, 7, 100), make(1, 7, 61), make(kRow, 3, 90), make(kRow + 1, 0, 0)})
          .surfaces[0];
  EXPECT_EQ(most.class_id, 7);
  EXPECT_EQ(most.confidence, 54);  // 161 / 3
  EXPECT_EQ(Parent({make(0, 7, 1), make(1, 8, 99), make(kRow, 9, 99)}).surfaces[0].confidence, 1);
  EXPECT_EQ(Parent({make(0, 0, 0)}).surfaces[0].confidence, 0);
}

TEST(OverviewTest, EveryChildCellLandsInItsParentCell) {
  // One surface in every third cell of a 2 × 2 block of tiles; its height tells where it is.
  const SurfaceWorld world = Draw(
      [](CellIndex cell) {
        if ((cell.x + 3 * cell.y) % 7 != 0) return std::vector<Level>{};
        return std::vector<Level>{{.z_m = 1e-3 * cell.x + 1e-4 * cell.y}};
      },
      -256,
      256,
      -256,
      256);
  const SurfaceWorld above = Up(world);
  std::map<CellIndex, std::vector<double>> expected;  // brute force
  for (const auto& [key, tile] : world) {
    for (const Surface& surface : tile.surfaces) {
      const CellIndex cell = CellOf(key, surface.cell);
      expected[{cell.x >> 1, cell.y >> 1}].push_back(surface.z_m);
    }
  }
  std::size_t count = 0;
  for (const auto& [key, tile] : above) {
    EXPECT_EQ(key.level, 1);
    EXPECT_EQ(tile.key, key);
    for (std::size_t i = 0; i < tile.surfaces.size(); ++i) {
      EXPECT_TRUE(i == 0 || tile.surfaces[i - 1].cell < tile.surfaces[i].cell);
      const std::vector<double>& heights = expected.at(CellOf(key, tile.surfaces[i].cell));
      double mean = 0.0;
      for (const double z : heights) mean += z / static_cast<double>(heights.size());
      EXPECT_NEAR(tile.surfaces[i].z_m, mean, 1e-6);
      EXPECT_EQ(tile.Cell(tile.surfaces[i].cell).size(), 1U);
      ++count;
    }
  }
  EXPECT_EQ(count, expected.size());
}

TEST(OverviewTest, UnderAndOverABridgeStayApartAtEveryLevel) {
  SurfaceWorld world = Draw(
      [](CellIndex cell) {
        std::vector<Level> levels = {{.z_m = 0.01 * std::sin(cell.x)}};
        if (cell.y >= 100 && cell.y < 160) levels.push_back({.z_m = 5.4, .depth_m = 0.4});
        return levels;
      },
      0,
      256,
      0,
      256);
  for (int level = 1; level <= kMaxLevel; ++level) {
    world = Up(world);
    ASSERT_EQ(world.size(), 1U);
    const SurfaceTile& tile = world.begin()->second;
    EXPECT_EQ(tile.key.level, level);
    int double_cells = 0;
    for (std::size_t i = 0; i < tile.surfaces.size(); ++i) {
      const float z = tile.surfaces[i].z_m;
      EXPECT_TRUE(std::abs(z) < 0.02 || std::abs(z - 5.4) < 0.02)
          << "level " << level << " z " << z;
      double_cells += tile.Cell(tile.surfaces[i].cell).size() == 2;
    }
    EXPECT_GT(double_cells, 0) << "level " << level;
  }
  EXPECT_EQ(world.begin()->second.surfaces.size(), 2U);
}

TEST(OverviewTest, HillShrinksByFourALevel) {
  // 30 % slope: a cell of a far level spans many gaps and is one surface all the same.
  SurfaceWorld world = Draw(
      [](CellIndex cell) { return std::vector<Level>{{.z_m = 0.03 * cell.x}}; }, 0, 256, 0, 256);
  std::size_t cells = 256UL * 256;
  for (int level = 1; level <= 8; ++level) {
    world = Up(world);
    cells /= 4;
    EXPECT_EQ(world.begin()->second.surfaces.size(), cells) << "level " << level;
  }
}

}  // namespace
}  // namespace strata
