// Prepared tiles: numbers of patches, costs of moves, and the bytes that are kept of them.
#include "core/planning/prepared_tile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/checksum.h"
#include "core/common/stop.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/least_dangers.h"
#include "core/planning/move_cost.h"
#include "core/planning/packed_tile.h"
#include "core/planning/patch_index.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;

constexpr double kCell = 0.1;

// Two tiles of broken ground: holes, posts, a second and a third storey here and there, classes.
// `step_m` is what heights are whole numbers of; `tower_m` how high one cell of each tile is.
MemoryTiles Drawn(std::uint64_t seed, double step_m, double tower_m) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.01);
  DrawnMap map;
  for (int y = 0; y < 90; ++y) {
    for (int x = 180; x < 330; ++x) {
      const auto kind = random() % 40;
      if (kind < 6) continue;
      double z = y / 90.0 + noise(random);
      std::vector<testing::DrawnSurface>& column = map[{x, y}];
      for (int storey = 0; storey < (x / 30 + y / 30) % 4; ++storey, z += 1.6) {
        column.push_back({std::round(z / step_m) * step_m, kind == 6 ? 0.9 : 0.1});
      }
    }
  }
  for (const int x : {200, 300}) map[{x, 45}] = {{tower_m, 1.0}};
  std::vector<SurfaceTile> tiles = map.Tiles();
  for (SurfaceTile& tile : tiles) {
    for (Surface& surface : tile.surfaces) {
      if (seed % 2 == 0) surface.class_id = static_cast<std::uint8_t>(surface.cell % 5);
    }
  }
  return MemoryTiles(std::move(tiles));
}

std::vector<PreparedTile> Prepare(MemoryTiles& source, const ProfileChecks& checks) {
  std::vector<PreparedTile> prepared;
  for (const TileKey& key : source.Keys()) {
    const absl::StatusOr<TileNeighbourhood> tiles = LoadAround(source, key);
    STRATA_EXPECT_OK(tiles.status());
    prepared.push_back(
        PrepareTile(*(*tiles)[kMiddleTile], GroundWindow(*tiles, checks.margin, kCell), checks));
  }
  return prepared;
}

// Whole steps; a range of more than 128 m; heights that are no whole steps.
struct Heights {
  double step_m;
  double tower_m;
  bool exact;
};
constexpr Heights kHeights[] = {
    {1.0 / 512.0, 2.0, false}, {1.0 / 512.0, 150.0, true}, {0.001, 2.0, true}};

std::vector<PreparedTile> ManyTiles(const Heights& heights) {
  std::vector<PreparedTile> all;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    MemoryTiles source = Drawn(seed, heights.step_m, heights.tower_m);
    for (const double gap_m : {0.0, 0.3}) {
      const auto checks = MakeProfileChecks(
          {.radius_m = 0.05 * static_cast<double>(seed % 3), .height_m = 1.0, .max_gap_m = gap_m},
          kCell);
      STRATA_EXPECT_OK(checks.status());
      for (PreparedTile& tile : Prepare(source, *checks)) all.push_back(std::move(tile));
    }
  }
  return all;
}

TEST(PatchIndexTest, NumbersEveryPatchOnce) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::vector<std::uint8_t> counts(65536, 0);
    std::uint32_t patches = 0;
    for (std::uint8_t& count : counts) {
      count = static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random() % seed);
      patches += count;
    }
    const PatchIndex index(counts);
    EXPECT_EQ(index.size(), patches);
    std::vector<std::uint8_t> seen(65536, 0);
    std::uint32_t next = 0;
    index.ForEach([&](std::uint32_t place, std::uint32_t number) {
      EXPECT_EQ(number, next++);
      EXPECT_EQ(index.Number(place), number);
      EXPECT_TRUE(index.Has(place));
      const std::uint16_t cell = index.CellOf(place);
      EXPECT_EQ(index.Place(cell, index.LevelOf(place)), place);
      ++seen[cell];
    });
    EXPECT_EQ(seen, counts);
    for (int cell = 0; cell < 65536; ++cell) {
      EXPECT_EQ(index.Place(static_cast<std::uint16_t>(cell), counts[cell]), PatchIndex::kNone);
    }
    EXPECT_EQ(PatchIndex::OfSheets(index.sheets(), index.upper_blocks()), index);
  }
}

TEST(PatchIndexTest, SheetsThatContradictEachOtherAreRefused) {
  std::vector<std::uint64_t> sheets(PatchIndex::kBlocks + 1, 0);
  sheets[7] = 6;
  sheets.back() = 2;
  EXPECT_TRUE(PatchIndex::OfSheets(sheets, {7}).has_value());
  EXPECT_FALSE(PatchIndex::OfSheets(sheets, {8}).has_value()) << "above nothing";
  EXPECT_FALSE(PatchIndex::OfSheets(sheets, {1024}).has_value()) << "no such block";
  EXPECT_FALSE(PatchIndex::OfSheets(sheets, {}).has_value()) << "a sheet too many";
  sheets.push_back(2);
  EXPECT_TRUE(PatchIndex::OfSheets(sheets, {7, 7}).has_value());
  EXPECT_FALSE(PatchIndex::OfSheets(sheets, {7, 6}).has_value()) << "not rising";
  sheets.back() = 0;
  EXPECT_FALSE(PatchIndex::OfSheets(sheets, {7, 7}).has_value()) << "an empty sheet";
}

TEST(StepCostsTest, AreTheCostsOfMoves) {
  const StepCosts costs(kCell, 0.2F);
  for (const int direction : {0, 1}) {
    const double run = direction == 0 ? kCell : kCell * 1.4142135623730951;
    for (std::uint32_t rise = 0; rise < 300; ++rise) {  // beyond the largest too
      for (const double danger : {0.0, 0.125, 3.5}) {
        EXPECT_EQ(costs.OfSteps(direction, rise, 2.0 + 2.0 * danger),
                  MoveCost(run, rise / 512.0, danger, kCell));
      }
    }
  }
  EXPECT_GE(costs.OfSteps(0, 0, 2.0), kCostPerCell);
  EXPECT_GE(costs.OfSteps(1, 0, 2.0), kCostPerDiagonal);
}

TEST(PreparedTileTest, DangersAreKeptToOneInSixteenThousand) {
  for (double danger = 0.0; danger < 200.0; danger = danger * 1.01 + 1e-4) {
    EXPECT_NEAR(OnePlusDanger(DangerCode(danger)), 1.0 + danger, (1.0 + danger) / 16000.0);
  }
  EXPECT_EQ(OnePlusDanger(DangerCode(0.0)), 1.0F);
  EXPECT_GT(OnePlusDanger(DangerCode(1e9)), 250.0F);
}

TEST(PreparedTileTest, MovesLeadBackAtTheSameCost) {
  for (const Heights& heights : kHeights) {
    std::size_t gaps = 0;
    std::size_t moves = 0;
    MemoryTiles source = Drawn(2, heights.step_m, heights.tower_m);
    STRATA_ASSERT_OK_AND_ASSIGN(
        const ProfileChecks checks,
        MakeProfileChecks({.radius_m = 0.05, .height_m = 1.0, .max_gap_m = 0.3}, kCell));
    TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28));
    SearchSpace space(cache, source, checks);
    for (const TileKey& key : source.Keys()) {
      const int slot = space.SlotOf(key);
      const std::shared_ptr<const PreparedTile> tile = space.At(slot).tile;
      EXPECT_EQ(!tile->exact_heights.empty(), heights.exact);
      tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
        const PatchId from = space.slots()[slot].base + place;
        for (int k = 0; k < 8; ++k) {
          std::uint32_t cost = 0;
          int cells = 0;
          const PatchId to = space.Follow(from, k, &cost, &cells);
          EXPECT_EQ(to != kNoPatchId, space.HasMove(from, k));
          if (to == kNoPatchId) continue;
          ++moves;
          gaps += cells > 1 ? 1 : 0;
          std::uint32_t cost_back = 0;
          int cells_back = 0;
          EXPECT_EQ(space.Follow(to, k ^ 4, &cost_back, &cells_back), from);
          EXPECT_EQ(cost_back, cost);
          EXPECT_EQ(cells_back, cells);
          const CellIndex a = space.CellOfPatch(from);
          const CellIndex b = space.CellOfPatch(to);
          EXPECT_EQ(b, (CellIndex{a.x + cells * kStepX[k], a.y + cells * kStepY[k]}));
          const double mean = 0.5 * (static_cast<double>(space.Danger(from)) + space.Danger(to));
          EXPECT_EQ(cost,
                    MoveCost(cells * checks.StepLength(k),
                             space.Height(to) - space.Height(from),
                             mean + kGapDanger * (cells - 1) / cells,
                             kCell));
        }
      });
    }
    EXPECT_GT(gaps, 20U);
    EXPECT_GT(moves, 1000U);
  }
}

TEST(PackedTileTest, UnpacksToTheSameTile) {
  for (const Heights& heights : kHeights) {
    for (const PreparedTile& tile : ManyTiles(heights)) {
      EXPECT_EQ(!tile.exact_heights.empty(), heights.exact);
      const std::string packed = PackTile(tile, kCell);
      STRATA_ASSERT_OK_AND_ASSIGN(const PreparedTile unpacked, UnpackTile(packed, kCell));
      EXPECT_TRUE(unpacked == tile) << tile.key.ToString();
      EXPECT_EQ(PackTile(unpacked, kCell), packed);
      EXPECT_THAT(UnpackTile(packed, 0.05),
                  testing::StatusIs(absl::StatusCode::kDataLoss, ::testing::HasSubstr("cells of")));
    }
  }
}

// Seals `packed` again, so that what it holds is looked at and not only its checksum.
void Seal(std::string* packed) {
  const std::size_t size = packed->size() - 8;
  const std::uint64_t sum = Checksum64(absl::string_view(*packed).substr(0, size));
  std::memcpy(packed->data() + size, &sum, 8);
}

TEST(PackedTileTest, DamagedBytesAreRefused) {
  const std::vector<PreparedTile> tiles = ManyTiles(kHeights[0]);
  const std::string packed = PackTile(tiles.front(), kCell);
  std::mt19937_64 random(20261123);
  for (std::size_t size = 0; size < packed.size(); size += 1 + random() % 40) {
    EXPECT_THAT(UnpackTile(absl::string_view(packed).substr(0, size), kCell),
                testing::StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
  }
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = packed;
    damaged[random() % damaged.size()] ^= static_cast<char>(1 << random() % 8);
    EXPECT_THAT(UnpackTile(damaged, kCell),
                testing::StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
  }
}

TEST(PackedTileTest, LeastDangersAreHadByThemselvesAndCheckedAgainstThePatches) {
  for (const PreparedTile& tile : ManyTiles(kHeights[0])) {
    const std::string packed = PackTile(tile, kCell);
    STRATA_ASSERT_OK_AND_ASSIGN(const PackedLeastDangers first, UnpackLeastDangers(packed, kCell));
    EXPECT_EQ(first.key, tile.key);
    EXPECT_EQ(first.least, LeastDangersOf(tile));
    LeastDangers wrong = first.least;
    wrong[tile.key.x & 1023] ^= 1;
    EXPECT_THAT(UnpackTile(PackTile(tile, wrong, kCell), kCell),
                testing::StatusIs(absl::StatusCode::kDataLoss, ::testing::HasSubstr("dangers")));
    std::string damaged = packed;
    damaged[24] ^= 1;
    EXPECT_THAT(UnpackLeastDangers(damaged, kCell),
                testing::StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
    Seal(&damaged);
    EXPECT_FALSE(UnpackLeastDangers(damaged, kCell).value_or(first).least != first.least &&
                 UnpackTile(damaged, kCell).ok());
  }
}

// What a hand has changed and sealed is refused, or can be searched.
TEST(PackedTileTest, WhateverUnpacksCanBeSearched) {
  std::mt19937_64 random(7);
  const StepCosts costs(kCell, 0.15F);
  int accepted = 0;
  for (const PreparedTile& tile : ManyTiles(kHeights[0])) {
    for (int i = 0; i < 60; ++i) {
      PreparedTile changed = tile;
      const auto any = [&random](std::size_t n) { return random() % n; };
      switch (any(7)) {
        case 0:
          changed.patches[any(changed.patches.size())].moves = 0xFF;
          break;
        case 1:
          changed.patches[any(changed.patches.size())].height ^= 0x8000;
          break;
        case 2:
          changed.patches.pop_back();
          break;
        case 3:
          changed.far_moves.push_back({static_cast<std::uint32_t>(any(1U << 18)), 3, 9, 1, 5});
          break;
        case 4:
          changed.other_heights.push_back(1);
          break;
        case 5:
          changed.patches[any(changed.patches.size())].moves ^= 0x55;
          break;
        default:
          changed.patches[any(changed.patches.size())].danger ^= 0xFF00;
          break;
      }
      std::string packed = PackTile(changed, LeastDangersOf(tile), kCell);
      if (any(2) == 0) packed[20 + any(packed.size() - 28)] ^= static_cast<char>(1 << any(8));
      Seal(&packed);
      const absl::StatusOr<PreparedTile> unpacked = UnpackTile(packed, kCell);
      if (!unpacked.ok()) {
        EXPECT_EQ(unpacked.status().code(), absl::StatusCode::kDataLoss);
        continue;
      }
      ++accepted;
      std::uint64_t sum = 0;
      unpacked->standing.ForEach([&](std::uint32_t place, std::uint32_t number) {
        sum += unpacked->CellOf(place) + unpacked->ClassOf(number);
        for (int k = 0; k < 8; ++k) {
          if (const FarMove* const far = unpacked->Far(place, k)) sum += far->cost;
          if ((unpacked->patches[number].moves >> k & 1U) == 0) continue;
          int cells = 0;
          const std::uint32_t to = unpacked->Target(place, number, k, &cells);
          ASSERT_TRUE(unpacked->CanStand(to));
          sum += unpacked->Cost(costs, number, unpacked->standing.Number(to), k, cells);
        }
      });
      EXPECT_GT(sum, 0U);
    }
  }
  EXPECT_GT(accepted, 20);
}

}  // namespace
}  // namespace strata
