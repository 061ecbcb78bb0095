// What maps keep of prepared tiles outlives the program that prepared them.
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/checksum.h"
#include "core/common/random.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/packed_tile.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr double kCellM = 0.1;

// Uneven ground with steps, holes, a deck over a part of it and a class.
SurfaceTile UnevenGround(const TileKey& key) {
  SplitMix64 random(7);
  SurfaceTile tile;
  tile.key = key;
  tile.version = 1;
  for (int cell = 0; cell < kTileCells * kTileCells; ++cell) {
    const int x = cell % kTileCells;
    const int y = cell / kTileCells;
    if (x % 37 < 2 && y % 11 < 3) continue;
    const int step = (x / 50 + y / 70) % 3;
    const auto ticks = static_cast<float>(80 * step + static_cast<int>(random.Below(6)));
    Surface ground{.cell = static_cast<std::uint16_t>(cell), .z_m = ticks / 512.0F};
    ground.sigma_m = 0.01F;
    ground.class_id = y < 40 ? 3 : 0;
    tile.surfaces.push_back(ground);
    if (x > 60 && x < 120 && y > 100) {
      ground.z_m = 2.5F;
      ground.depth_m = 0.25F;
      tile.surfaces.push_back(ground);
    }
  }
  tile.IndexRows();
  return tile;
}

TEST(PreparationFormTest, IsAnotherNumberForOtherBytes) {
  MemoryTiles source({UnevenGround({0, 0, 0}), UnevenGround({0, 1, 0})});
  STRATA_ASSERT_OK_AND_ASSIGN(const ProfileChecks checks, MakeProfileChecks({}, kCellM));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto tile, PrepareFrom(source, {0, 0, 0}, checks));
  // Whoever changes what tiles are prepared to, or how that is packed, changes both numbers.
  EXPECT_EQ(std::make_pair(kPreparationForm, Checksum64(PackTile(*tile, kCellM))),
            std::make_pair(std::uint32_t{2}, std::uint64_t{6421900820408289829U}));
}

}  // namespace
}  // namespace strata::testing
