// A tile holds so much and no more: what would not be readable is not written, and what comes after
// it goes on.
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/scans.h"
#include "core/codec/occupancy.h"
#include "core/codec/surface_tile_codec.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/overview.h"
#include "core/mls/tile_key.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

// Surfaces in every cell but the last, one tick apart.
MlsTile TileOf(const TileKey& key, std::size_t patches) {
  MlsTile tile;
  tile.key = key;
  tile.patches.resize(patches);
  const std::size_t cells = std::size_t{kTileCells} * kTileCells - 1;
  for (std::size_t i = 0; i < patches; ++i) {
    const std::size_t layers = (patches + cells - 1) / cells;
    tile.patches[i].cell = static_cast<std::uint16_t>(i / layers);
    tile.patches[i].z_min = tile.patches[i].z_max = static_cast<std::int32_t>(i % layers);
  }
  tile.IndexRows();
  return tile;
}

TEST(CheckRoomInTilesTest, CountsWhatTheJoinedTileWouldHave) {
  const TileKey key{0, 3, -1};
  MlsMap contribution;
  contribution.parameters.gap_size_m = 1.0 / kTicksPerMetre;
  contribution.tiles = {TileOf({0, 2, 0}, 10), TileOf(key, 10)};
  MlsTileMap tiles;
  tiles[{0, 2, 0}] = nullptr;
  tiles[key] = std::make_shared<const MlsTile>(TileOf(key, kMaxTilePatches));
  // The same surfaces again are those that are there.
  STRATA_EXPECT_OK(CheckRoomInTiles(contribution, tiles));
  contribution.tiles[1].patches[0].cell = kTileCells * kTileCells - 1;
  contribution.tiles[1].patches.resize(1);
  EXPECT_THAT(CheckRoomInTiles(contribution, tiles),
              StatusIs(absl::StatusCode::kOutOfRange,
                       HasSubstr("tile 0/3/-1 of 4194305 patches; at most 4194304")));
  tiles.erase(key);
  STRATA_EXPECT_OK(CheckRoomInTiles(contribution, tiles));
}

// `layers` points in every other cell, in both directions, of the tiles (0, y) and (1, y): the
// overview of a tile has as many surfaces as the tile.
PointCloud Stacks(int y, int layers) {
  constexpr double kCellM = 0.1;
  PointCloud cloud;
  for (int row = 0; row < kTileCells; row += 2) {
    for (int column = 0; column < 2 * kTileCells; column += 2) {
      for (int layer = 0; layer < layers; ++layer) {
        cloud.points.emplace_back(static_cast<float>((column + 0.5) * kCellM),
                                  static_cast<float>((y * kTileCells + row + 0.5) * kCellM),
                                  static_cast<float>(0.5 * layer));
      }
    }
  }
  return cloud;
}

// Four tiles that can be read, of one that could not.
TEST_F(EngineTest, AnOverviewOfMoreThanATileHoldsStopsNobody) {
  MapParameters parameters;
  parameters.mls.gap_size_m = 0.3;
  MakeMap(parameters);
  constexpr int kLayers = static_cast<int>(kOverviewLayers) + 1;
  for (const int y : {0, 1}) {
    const PointCloud cloud = Stacks(y, kLayers);
    const ScanId id{"run", static_cast<std::uint64_t>(y)};
    STRATA_ASSERT_OK(
        Upload(db(), HeaderOf(id, cloud, Pose::Identity()), cloud, api::kMaxPointsPerChunk));
  }
  EXPECT_EQ(WaitIntegrated(db()).scans_failed, 0U);
  const auto tiles = AllTiles(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile whole, DecodeSurfaceTile(tiles.at({0, 0, 0})));
  EXPECT_EQ(whole.surfaces.size(), kTileCells * kTileCells / 4 * kLayers);
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile overview, DecodeSurfaceTile(tiles.at({1, 0, 0})));
  EXPECT_EQ(overview.surfaces.size(), kMaxTilePatches);
  STRATA_EXPECT_OK(DecodeSurfaceTile(tiles.at({2, 0, 0})));
}

}  // namespace
}  // namespace strata::testing
