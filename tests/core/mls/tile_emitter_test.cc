// Patches and layers out of sorted measurements, against the plain map builder.
#include "core/mls/tile_emitter.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/measurement.h"
#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;
using ::strata::testing::Uniform;

constexpr TileKey kCorner = {0, -70, 1000};

// Measurement `m` as a key whose tile bytes count from kCorner.
std::uint64_t KeyOf(const ReferenceMeasurement& m) {
  const TileKey tile = TileOfCell(m.cell);
  return static_cast<std::uint64_t>(tile.x - kCorner.x) << 56 |
         static_cast<std::uint64_t>(tile.y - kCorner.y) << 48 |
         std::uint64_t{CellInTile(m.cell)} << 32 |
         static_cast<std::uint64_t>(m.z + (1 << 23)) << 8 | (255U - m.sigma_code);
}

template <typename Item>
Item ItemOf(const ReferenceMeasurement& m, std::size_t point) {
  if constexpr (std::is_same_v<Item, IndexedMeasurement>) {
    return {KeyOf(m), static_cast<std::uint32_t>(point)};
  } else {
    return {KeyOf(m)};
  }
}

// The map that EmitTiles makes; the columns of the measurements count for indexed items only.
template <typename Item>
MlsMap Emitted(const std::vector<ReferenceMeasurement>& measurements,
               const MlsParameters& parameters,
               EmitScratch& scratch) {
  PointCloud cloud;
  std::vector<Item> items;
  for (const ReferenceMeasurement& m : measurements) {
    items.push_back(ItemOf<Item>(m, items.size()));
    if constexpr (std::is_same_v<Item, IndexedMeasurement>) {
      cloud.colour.push_back(m.colour);
      cloud.label.push_back(m.label);
    }
  }
  std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
    return CellOfKey(a.key) < CellOfKey(b.key);
  });
  MlsMap map;
  map.parameters = parameters;
  EmitTiles(std::span<Item>(items), kCorner, cloud, parameters, scratch, map.tiles);
  return map;
}

struct Crowd {
  int tiles;   // along an edge
  int cells;   // along an edge of a tile, from its corner
  int height;  // ticks
};

ReferenceMeasurement Draw(std::mt19937_64& random, const Crowd& crowd) {
  const auto below = [&random](int n) { return static_cast<std::int32_t>(random() % n); };
  ReferenceMeasurement m;
  m.cell = {(kCorner.x + below(crowd.tiles)) * kTileCells + below(crowd.cells),
            (kCorner.y + below(crowd.tiles)) * kTileCells + below(crowd.cells)};
  m.z = below(crowd.height) - crowd.height / 2;
  m.sigma_code = static_cast<std::uint8_t>(random());
  m.colour = {static_cast<std::uint8_t>(random()), 7, static_cast<std::uint8_t>(random())};
  m.label = static_cast<std::uint16_t>(random() % 4);
  return m;
}

TEST(TileEmitterTest, MakesTheMapOfThePlainBuilder) {
  constexpr Crowd kCrowds[] = {{1, 256, 200}, {3, 4, 8000}, {2, 1, 60}, {256, 256, 1 << 23}};
  EmitScratch scratch;  // one for all: nothing of one map may show in the next
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const MlsParameters parameters{.cell_size_m = 0.1,
                                   .gap_size_m = Uniform(random, 0.05, 1.5),
                                   .thickness_m = Uniform(random, 0.01, 0.3)};
    std::vector<ReferenceMeasurement> measurements(random() % 2000);
    for (ReferenceMeasurement& m : measurements) m = Draw(random, kCrowds[seed % 4]);
    EXPECT_TRUE(Emitted<IndexedMeasurement>(measurements, parameters, scratch) ==
                ReferenceMap(measurements, parameters, true));
    for (ReferenceMeasurement& m : measurements) m.label = 0;
    EXPECT_TRUE(Emitted<Measurement>(measurements, parameters, scratch) ==
                ReferenceMap(measurements, parameters, false));
  }
}

// Up to a dozen measurements of a cell are sorted by another way than more.
TEST(TileEmitterTest, CellsOfEverySizeAreCutIntoTheSameIntervals) {
  EmitScratch scratch;
  std::mt19937_64 random(3);
  const MlsParameters parameters{.gap_size_m = 0.2};
  for (std::size_t count = 1; count <= 40; ++count) {
    SCOPED_TRACE(count);
    for (int repeat = 0; repeat < 20; ++repeat) {
      std::vector<ReferenceMeasurement> measurements(count);
      for (ReferenceMeasurement& m : measurements) m = Draw(random, {1, 1, 40'000});
      EXPECT_TRUE(Emitted<IndexedMeasurement>(measurements, parameters, scratch) ==
                  ReferenceMap(measurements, parameters, true));
    }
  }
}

TEST(TileEmitterTest, SumsAndCountsThatAreFullStayFull) {
  const MlsParameters parameters{.gap_size_m = 2.0, .thickness_m = 1.0};
  const std::uint64_t bound = MaxWeightSum(parameters.thickness_ticks());
  const std::uint64_t enough = bound / WeightOfCode(0) + 1;  // 4 million
  for (const std::uint64_t count : {enough - 1, enough}) {
    std::vector<Measurement> items(count);
    for (std::size_t i = 0; i < items.size(); ++i) {
      ReferenceMeasurement m;
      m.cell = {kCorner.x * kTileCells, kCorner.y * kTileCells};
      m.z = 100 * static_cast<std::int64_t>(i % 2);
      items[i].key = KeyOf(m);
    }
    EmitScratch scratch;
    std::vector<MlsTile> tiles;
    EmitTiles(std::span<Measurement>(items), kCorner, PointCloud(), parameters, scratch, tiles);
    ASSERT_EQ(tiles.size(), 1U);
    ASSERT_EQ(tiles[0].patches.size(), 1U);
    const Patch& patch = tiles[0].patches[0];
    const bool full = count == enough;
    EXPECT_EQ(patch.count, Patch::kMaxCount);
    EXPECT_EQ(patch.sum_w, full ? bound : count * WeightOfCode(0));
    EXPECT_EQ(patch.sum_wz, full ? 0 : count / 2 * WeightOfCode(0) * 100);
    EXPECT_EQ(patch.sum_wzz, full ? 0 : count / 2 * WeightOfCode(0) * 10'000);
    EXPECT_EQ(patch.z_max, 100);
  }
}

TEST(TileEmitterTest, NothingMakesNothing) {
  EmitScratch scratch;
  EXPECT_TRUE(Emitted<Measurement>({}, MlsParameters(), scratch).tiles.empty());
}

}  // namespace
}  // namespace strata
