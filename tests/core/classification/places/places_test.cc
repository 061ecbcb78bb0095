// Places of drawn storeys whose rooms, corridors and doorways are known.
#include "core/classification/places/places.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/places/place_features.h"
#include "core/classification/places/range_scan_features.h"
#include "tests/support/simulator/floor_plans.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::_;
using testing::DrawFloor;
using testing::DrawnFloor;
using ::testing::HasSubstr;
using testing::StatusIs;
using Code = absl::StatusCode;
using Cell = std::pair<std::int32_t, std::int32_t>;

// Of every cell, the number of its place; a cell of two is told.
std::map<Cell, int> PlaceOfCells(const std::vector<Place>& places) {
  std::map<Cell, int> of_cell;
  for (std::size_t k = 0; k < places.size(); ++k) {
    for (const PlaceBlock& block : places[k].blocks) {
      for (int bit = 0; bit < 64; ++bit) {
        if ((block.cells >> bit & 1U) == 0) continue;
        const Cell cell{8 * block.x + bit % 8, 8 * block.y + bit / 8};
        EXPECT_TRUE(of_cell.emplace(cell, static_cast<int>(k)).second);
      }
    }
  }
  return of_cell;
}

// Nothing was learned from these seeds; learn_places has others.
TEST(PlacesTest, DrawnStoreysAreNamed) {
  std::uint64_t cells = 0, right = 0, doorways = 0, found = 0;
  for (const std::uint64_t seed : {41U, 42U, 43U, 44U, 45U, 46U}) {
    SCOPED_TRACE(seed);
    const DrawnFloor floor = DrawFloor(0.1, seed);
    STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> places,
                                FindPlaces(floor.blocks, 0.1, true, Stop()));
    const std::map<Cell, int> place_of = PlaceOfCells(places);
    ASSERT_EQ(place_of.size(), floor.kinds.size());  // every free cell, and no other
    for (const auto& [cell, kind] : floor.kinds) {
      ASSERT_TRUE(place_of.contains(cell));
      const bool same = places[static_cast<std::size_t>(place_of.at(cell))].kind == kind;
      ++cells;
      right += same ? 1 : 0;
      doorways += kind == PlaceKind::kDoorway ? 1 : 0;
      found += kind == PlaceKind::kDoorway && same ? 1 : 0;
    }
  }
  EXPECT_GE(static_cast<double>(right), 0.9 * static_cast<double>(cells))
      << right << " of " << cells;
  EXPECT_GE(static_cast<double>(found), 0.2 * static_cast<double>(doorways))
      << found << " of " << doorways;
}

TEST(PlacesTest, PlacesAreWhatTheirCellsSay) {
  const DrawnFloor floor = DrawFloor(0.1, 51);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> places,
                              FindPlaces(floor.blocks, 0.1, true, Stop()));
  ASSERT_GT(places.size(), 2U);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Place& place = places[k];
    EXPECT_LE(place.area_m2, places[k > 0 ? k - 1 : 0].area_m2);
    if (place.kind != PlaceKind::kDoorway && !place.neighbours.empty()) {
      EXPECT_GE(place.area_m2, 1.0 - 1e-9);
    }
    std::size_t cells = 0;
    for (const PlaceBlock& block : place.blocks) cells += std::popcount(block.cells);
    EXPECT_NEAR(place.area_m2, 0.01 * static_cast<double>(cells), 1e-9);
    EXPECT_TRUE((place.middle.array() > place.low.array()).all());
    EXPECT_TRUE((place.middle.array() < place.high.array()).all());
    for (const int other : place.neighbours) {
      const Place& touched = places.at(static_cast<std::size_t>(other));
      EXPECT_NE(touched.kind, place.kind);
      EXPECT_THAT(touched.neighbours, ::testing::Contains(static_cast<int>(k)));
    }
  }
  for (const auto& [cell, number] : PlaceOfCells(places)) {
    const Place& place = places[static_cast<std::size_t>(number)];
    EXPECT_GE(0.1 * cell.first, place.low.x() - 1e-9);
    EXPECT_LE(0.1 * (cell.second + 1), place.high.y() + 1e-9);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> bare,
                              FindPlaces(floor.blocks, 0.1, false, Stop()));
  ASSERT_EQ(bare.size(), places.size());
  EXPECT_TRUE(bare[0].blocks.empty());
}

TEST(PlacesTest, NothingIsNoPlace) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> none, FindPlaces({}, 0.1, true, Stop()));
  EXPECT_TRUE(none.empty());
  const std::vector<FloorBlock> wall = {{3, -2, 0, ~std::uint64_t{0}, 0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> walled, FindPlaces(wall, 0.1, true, Stop()));
  EXPECT_TRUE(walled.empty());
}

TEST(PlacesTest, OneCellIsOnePlace) {
  const std::vector<FloorBlock> cell = {{-1, 5, std::uint64_t{1} << 9, 0, 0}};
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Place> places, FindPlaces(cell, 0.5, true, Stop()));
  ASSERT_EQ(places.size(), 1U);
  EXPECT_EQ(places[0].blocks, (std::vector<PlaceBlock>{{-1, 5, std::uint64_t{1} << 9}}));
  EXPECT_NEAR((places[0].middle - Eigen::Vector2d(-3.25, 20.75)).norm(), 0.0, 1e-9);
  EXPECT_TRUE(places[0].neighbours.empty());
}

TEST(PlacesTest, WhatIsTooLargeIsRefusedBeforeItIsHeld) {
  constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
  const std::vector<FloorBlock> apart = {{-kFar, -kFar, 1, 0, 0}, {kFar, kFar, 1, 0, 0}};
  EXPECT_THAT(FindPlaces(apart, 0.1, true, Stop()),
              StatusIs(Code::kResourceExhausted, HasSubstr("16777216 cells")));
  std::vector<FloorBlock> wide;  // 512 × 512 free cells of 1 m, each a sample
  for (std::int32_t y = 0; y < 64; ++y) {
    for (std::int32_t x = 0; x < 64; ++x) wide.push_back({x, y, ~std::uint64_t{0}, 0, 0});
  }
  EXPECT_THAT(FindPlaces(wide, 1.0, true, Stop()),
              StatusIs(Code::kResourceExhausted, HasSubstr("200000 squares")));
}

TEST(PlacesTest, AStoppedSearchSaysSo) {
  const Stop stop;
  stop.Request();
  EXPECT_THAT(FindPlaces(DrawFloor(0.2, 1).blocks, 0.2, true, stop), StatusIs(Code::kCancelled, _));
}

// A map that grows elsewhere does not move the squares that are looked at.
TEST(PlacesTest, SquaresBeginAtCellsOfTheMap) {
  const std::vector<FloorBlock> one = {{5, 7, ~std::uint64_t{0}, 0, 0}};
  const std::vector<FloorBlock> two = {{5, 7, ~std::uint64_t{0}, 0, 0}, {-4, -3, 1, 0, 0}};
  std::vector<std::set<Cell>> looked_at;
  for (const auto& blocks : {one, two}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const FreeSpace space, OpenSpace(blocks, 0.1));
    STRATA_ASSERT_OK_AND_ASSIGN(const PlaceSamples samples, PlaceSamples::Of(space));
    std::set<Cell>& cells = looked_at.emplace_back();
    const Eigen::Vector2i origin = (space.min_m() / 0.1).array().round().matrix().cast<int>();
    for (std::uint32_t i = 0; i < samples.size(); ++i) {
      const Eigen::Vector2i cell = origin + samples.cell(i);
      if (cell.x() >= 40) cells.insert({cell.x(), cell.y()});
    }
  }
  EXPECT_GE(looked_at[0].size(), 9U);
  EXPECT_EQ(looked_at[0], looked_at[1]);
}

// Turned by whole beams, a scan keeps its numbers.
TEST(RangeScanFeaturesTest, DoNotTellWhichWayTheScannerLooks) {
  std::vector<float> ranges;
  for (int k = 0; k < 60; ++k) ranges.push_back(1.0F + 0.05F * static_cast<float>(k * k % 37));
  std::vector<float> turned(ranges.begin() + 17, ranges.end());
  turned.insert(turned.end(), ranges.begin(), ranges.begin() + 17);
  const RangeScanFeatures features(60);
  const std::vector<float> a = features.Of(ranges);
  const std::vector<float> b = features.Of(turned);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_NEAR(a[i], b[i], 1e-3F * (1.0F + std::abs(a[i]))) << i;
}

}  // namespace
}  // namespace strata
