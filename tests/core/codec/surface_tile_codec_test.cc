#include "core/codec/surface_tile_codec.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/escaping.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "core/codec/occupancy.h"
#include "core/mls/build.h"
#include "core/mls/surface_tile.h"
#include "tests/core/codec/hostile.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::IsOkAndHolds;
using ::strata::testing::RandomTile;

// Surfaces of a tile with made-up annotation.
SurfaceTile Annotated(const MlsTile& tile, std::uint64_t seed) {
  SurfaceTile surfaces = SurfacesOf(tile);
  surfaces.version = seed;
  std::mt19937_64 random(seed);
  for (Surface& surface : surfaces.surfaces) {
    if (seed % 4 != 0) surface.colour = {};
    surface.traversability = static_cast<Traversability>(random() % 3);
    surface.class_id = static_cast<std::uint8_t>(random());
    surface.confidence = static_cast<std::uint8_t>(surface.class_id == 0 ? 0 : 1 + random() % 100);
    surface.cost = std::exp2(static_cast<float>(random() % 1000) / 50.0F) - 1.0F;
    if (random() % 8 == 0) surface.cost = std::numeric_limits<float>::infinity();
    if (seed % 2 == 0 && random() % 6 == 0) {
      surface.traversability = Traversability::kUnderside;
      surface.cost = 0.0F;
    }
  }
  return surfaces;
}

std::string Encoded(const SurfaceTile& tile) { return EncodeSurfaceTile(tile).value(); }

void ExpectWithinTolerance(const Surface& read, const Surface& written) {
  EXPECT_EQ(read.cell, written.cell);
  EXPECT_EQ(read.traversability, written.traversability);
  EXPECT_EQ(read.class_id, written.class_id);
  EXPECT_EQ(read.confidence, written.confidence);
  EXPECT_EQ(read.coloured(), written.coloured());
  EXPECT_NEAR(read.colour.r, written.colour.r, 2);
  EXPECT_NEAR(read.colour.g, written.colour.g, 2);
  EXPECT_NEAR(read.colour.b, written.colour.b, 2);
  EXPECT_EQ(read.vertical(), written.vertical());
  EXPECT_NEAR(read.z_m, written.z_m, 0.001);
  EXPECT_NEAR(read.depth_m, written.depth_m, 0.001);
  EXPECT_NEAR(read.sigma_m / written.sigma_m, 1.0, 0.05);
  if (std::isinf(written.cost) || written.cost == 0.0F) {
    EXPECT_EQ(read.cost, written.cost);
  } else {
    const float bound = written.traversability == Traversability::kTraversable ? 0.0601F : 0.1901F;
    EXPECT_NEAR(std::log1p(read.cost), std::log1p(written.cost), std::log1p(bound));
  }
}

void ExpectRoundTrip(const SurfaceTile& tile) {
  const std::string bytes = Encoded(tile);
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile read, DecodeSurfaceTile(bytes));
  EXPECT_EQ(read.key, tile.key);
  EXPECT_EQ(read.version, tile.version);
  EXPECT_EQ(read.row_begin, tile.row_begin);
  ASSERT_EQ(read.surfaces.size(), tile.surfaces.size());
  for (std::size_t i = 0; i < tile.surfaces.size(); ++i) {
    SCOPED_TRACE(i);
    ExpectWithinTolerance(read.surfaces[i], tile.surfaces[i]);
  }
  EXPECT_EQ(Encoded(read), bytes);
}

TEST(SurfaceTileCodecTest, RandomTilesRoundTripWithinTolerance) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    SurfaceTile tile = Annotated(RandomTile(seed, 1 << seed % 13, true), seed);
    tile.key = {static_cast<int>(seed % 13), -(1 << 30), static_cast<int>(seed)};
    ExpectRoundTrip(tile);
  }
}

TEST(SurfaceTileCodecTest, EmptyTileRoundTrips) { ExpectRoundTrip(SurfaceTile()); }

TEST(SurfaceTileCodecTest, EveryCodeOfSigmaAndCostIsStable) {
  SurfaceTile tile;
  for (int i = 0; i < 256; ++i) {
    tile.surfaces.push_back({.cell = static_cast<std::uint16_t>(i),
                             .traversability = static_cast<Traversability>(i % 3),
                             .sigma_m = std::exp2(static_cast<float>(i) / 7.5F - 24.0F),
                             .cost = std::exp2(static_cast<float>(i) / 6.0F)});
  }
  tile.IndexRows();
  ExpectRoundTrip(tile);
}

TEST(SurfaceTileCodecTest, AbsurdValuesAreClampedAndDecodable) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  SurfaceTile tile;
  for (const float value : {kInf, -kInf, std::nanf(""), 1e30F, -1e30F, 1e-30F}) {
    tile.surfaces.push_back({.cell = static_cast<std::uint16_t>(tile.surfaces.size()),
                             .z_m = value,
                             .sigma_m = value,
                             .depth_m = value,
                             .cost = value});
  }
  const std::string bytes = Encoded(tile);
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile read, DecodeSurfaceTile(bytes));
  EXPECT_EQ(Encoded(read), bytes);
  EXPECT_FLOAT_EQ(read.surfaces[0].z_m, 32768.0F);
}

TEST(SurfaceTileCodecTest, RealTilesRoundTripWithinTheirBound) {
  STRATA_REQUIRE_DATA(path, "nclt_campus_loop");
  const MlsMap map = testing::NcltMap(path, 40);
  std::size_t bytes = 0;
  for (const MlsTile& tile : map.tiles) {
    const SurfaceTile surfaces = SurfacesOf(tile);
    ExpectRoundTrip(surfaces);
    bytes += Encoded(surfaces).size();
  }
  EXPECT_LE(static_cast<double>(bytes) / static_cast<double>(map.patch_count()), 2.9);
}

// What has no class costs nothing, and is read by those who know of no confidence.
TEST(SurfaceTileCodecTest, OnlyTilesWithConfidencesAreOfTheSecondVersion) {
  SurfaceTile tile = Annotated(RandomTile(7, 300, true), 7);
  EXPECT_EQ(VersionOfBlob(Encoded(tile)), 2);
  for (Surface& surface : tile.surfaces) surface.confidence = 0;
  const std::string plain = Encoded(tile);
  EXPECT_EQ(VersionOfBlob(plain), 1);
  ExpectRoundTrip(tile);
  for (Surface& surface : tile.surfaces) {
    if (surface.class_id == 0) surface.confidence = 50;
  }
  EXPECT_EQ(Encoded(tile), plain);
}

TEST(SurfaceTileCodecTest, EveryShadeIsStableAndBlackIsAColour) {
  SurfaceTile tile;
  for (int i = 0; i < 256; ++i) {
    const auto shade = static_cast<std::uint8_t>(i);
    tile.surfaces.push_back({.cell = static_cast<std::uint16_t>(i),
                             .colour = Known({.r = shade, .g = 0, .b = 255}),
                             .sigma_m = 0.01F});
  }
  tile.surfaces[7].colour = Known({});
  tile.surfaces[9].colour = {};
  tile.IndexRows();
  ExpectRoundTrip(tile);
  EXPECT_EQ(VersionOfBlob(Encoded(tile)), 4);
}

// A wall and a street of photographs' colours: 9 m of eth_facade at cells of 5 cm.
TEST(SurfaceTileCodecTest, RecordedColoursTakeAByteAndAHalfAPatchAtMost) {
  STRATA_REQUIRE_DATA(path, "eth_facade_tls");
  const auto scans = testing::ListScans(path / "scans");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud,
                              testing::ReadBinaryPcd(scans.begin()->second));
  ASSERT_FALSE(cloud.colour.empty());
  for (const double cell_size_m : {0.05, 0.1}) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        const MlsBuildResult built,
        BuildMlsMap(cloud, Pose::Identity(), SensorModel(), {.cell_size_m = cell_size_m}));
    std::size_t with = 0;
    std::size_t without = 0;
    for (const MlsTile& tile : built.map.tiles) {
      SurfaceTile surfaces = SurfacesOf(tile);
      with += Encoded(surfaces).size();
      for (Surface& surface : surfaces.surfaces) surface.colour = {};
      without += Encoded(surfaces).size();
    }
    const auto patches = static_cast<double>(built.map.patch_count());
    EXPECT_LE(static_cast<double>(with - without) / patches, 1.5) << without / patches;
  }
}

TEST(SurfaceTileCodecTest, WhatNoDecoderTakesIsNotWritten) {
  SurfaceTile tile;
  tile.key = {2, 7, -3};
  tile.surfaces.resize(kMaxTilePatches + 1);
  EXPECT_THAT(
      EncodeSurfaceTile(tile),
      testing::StatusIs(absl::StatusCode::kResourceExhausted,
                        ::testing::HasSubstr("tile 2/7/-3 of 4194305 surfaces; at most 4194304")));
}

TEST(SurfaceTileCodecTest, DamageIsDataLoss) {
  const SurfaceTile tile = Annotated(RandomTile(5, 300, true), 5);
  testing::ExpectDamageIsDataLoss(Encoded(tile), &DecodeSurfaceTile, 5, 1000);
}

TEST(SurfaceTileCodecTest, ForgedBytesNeverCrash) {
  const std::string bytes = Encoded(Annotated(RandomTile(6, 60, true), 6));
  const int accepted =
      testing::DecodeForgedBodies(BlobKind::kSurfaceTile, bytes, &DecodeSurfaceTile, 6, 4000);
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 4000);
}

TEST(SurfaceTileCodecTest, GoldenBytesOfATinyTileDecode) {
  SurfaceTile tile;
  tile.key = {1, -1, 2};
  tile.version = 77;
  tile.surfaces = {{.cell = 0,
                    .traversability = Traversability::kTraversable,
                    .class_id = 3,
                    .z_m = 0.5F,
                    .sigma_m = 0.02F,
                    .cost = 0.25F},
                   {.cell = 1, .z_m = 1.5F, .sigma_m = 0.03F, .depth_m = 1.25F, .cost = 7.0F}};
  tile.IndexRows();
  // Of version 1: must be readable for ever. (Another zstd release may write other bytes.)
  const std::string golden = absl::HexStringToBytes(
      "53535431010001005e00000001ffffffff020000004d00000000000000028080011228b52ffd00204d0000100500"
      "0100fb9f075800000001000000000000000002020100020300000284860000000000000001860000000182000108"
      "00010c0001040000050014000001bc654a917e61afd9");
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile read, DecodeSurfaceTile(golden));
  EXPECT_EQ(read.key, tile.key);
  EXPECT_EQ(read.version, tile.version);
  ASSERT_EQ(read.surfaces.size(), 2U);
  for (int i = 0; i < 2; ++i) ExpectWithinTolerance(read.surfaces[i], tile.surfaces[i]);
}

TEST(SurfaceTileCodecTest, GoldenBytesOfATinyTileWithAConfidenceDecode) {
  SurfaceTile tile;
  tile.surfaces = {{.cell = 0, .class_id = 3, .confidence = 87, .z_m = 0.5F, .sigma_m = 0.02F},
                   {.cell = 1, .z_m = 1.5F, .sigma_m = 0.03F}};
  tile.IndexRows();
  // Of version 2: must be readable for ever.
  const std::string golden = absl::HexStringToBytes(
      "53535431020002005b0000000000000000000000000000000000000000028080011228b52ffd00204d0000100500"
      "0100fb9f075800000001030000000000000000000203000001840000000186000000000000000282080000010200"
      "0000000000015703001400c16fe3f42162b66b");
  STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile read, DecodeSurfaceTile(golden));
  ASSERT_EQ(read.surfaces.size(), 2U);
  for (int i = 0; i < 2; ++i) ExpectWithinTolerance(read.surfaces[i], tile.surfaces[i]);
}

}  // namespace
}  // namespace strata
