// Points of what was inferred, cell by cell.
#include "core/world/things/inferred_tile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace strata {
namespace {

constexpr double kCell = 0.1;

std::vector<Eigen::Vector3d> RandomPoints(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-30.0, 30.0);
  std::uniform_real_distribution<double> height(-1.0, 3.0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double x = place(random);
    const double y = place(random);
    for (int n = 0; n < 10; ++n) points.emplace_back(x, y, height(random));
  }
  return points;
}

InferredTileMap TilesOf(const std::vector<Eigen::Vector3d>& points) {
  InferredTileMaker maker(kCell);
  maker.Add(points);
  return maker.Finish();
}

TEST(InferredTileTest, EveryPointIsInASpanAndEverySpanEndsAtPoints) {
  const std::vector<Eigen::Vector3d> points = RandomPoints(3000, 1);
  const InferredTileMap tiles = TilesOf(points);
  std::size_t spans = 0;
  for (const Eigen::Vector3d& p : points) {
    const CellIndex cell{static_cast<std::int32_t>(std::floor(p.x() / kCell)),
                         static_cast<std::int32_t>(std::floor(p.y() / kCell))};
    const auto tile = tiles.find(TileOfCell(cell));
    ASSERT_NE(tile, tiles.end());
    EXPECT_EQ(tile->second->key, TileOfCell(cell));
    const auto z = static_cast<float>(p.z());
    const auto column = tile->second->Cells(CellInTile(cell), CellInTile(cell) + 1U);
    EXPECT_EQ(std::count_if(column.begin(),
                            column.end(),
                            [&](const InferredSpan& s) { return s.low_m <= z && z <= s.high_m; }),
              1);
  }
  for (const auto& [key, tile] : tiles) {
    EXPECT_EQ(tile->Cells(0, kTileCells * kTileCells).size(), tile->spans.size());
    spans += tile->spans.size();
    for (std::size_t i = 1; i < tile->spans.size(); ++i) {
      const InferredSpan& below = tile->spans[i - 1];
      const InferredSpan& span = tile->spans[i];
      ASSERT_LE(below.cell, span.cell);
      if (below.cell != span.cell) continue;
      EXPECT_GT(span.low_m - below.high_m, kInferredSpanGapM);
    }
  }
  EXPECT_GT(spans, 3000U);
  EXPECT_LT(spans, points.size());
}

TEST(InferredTileTest, TheVersionIsThatOfTheContent) {
  std::vector<Eigen::Vector3d> points = RandomPoints(200, 2);
  const InferredTileMap tiles = TilesOf(points);
  std::reverse(points.begin(), points.end());
  const InferredTileMap same = TilesOf(points);
  ASSERT_EQ(tiles.size(), same.size());
  for (const auto& [key, tile] : tiles) {
    EXPECT_EQ(tile->version, same.at(key)->version);
    EXPECT_EQ(tile->spans, same.at(key)->spans);
  }
  points[0].z() += 10.0;
  int others = 0;
  for (const auto& [key, tile] : TilesOf(points)) {
    others += tile->version != tiles.at(key)->version ? 1 : 0;
  }
  EXPECT_EQ(others, 1);
}

TEST(InferredTileTest, WhatIsBeyondTheMapIsLeftOut) {
  const double far = 2.0 * kMaxCellIndex * kCell;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(TilesOf({{far, 0, 0}, {0, -far, 0}, {nan, 0, 0}, {0, 0, nan}}).empty());
}

}  // namespace
}  // namespace strata
