#include "core/codec/mls_tile_codec.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/escaping.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/codec/occupancy.h"
#include "core/codec/tile_header.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"
#include "tests/core/codec/hostile.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::IsOkAndHolds;
using ::strata::testing::RandomTile;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

std::string Encoded(const MlsTile& tile) { return EncodeMlsTile(tile).value(); }

TEST(MlsTileCodecTest, RandomTilesRoundTripBitForBit) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    MlsTile tile = RandomTile(seed, 1 << seed % 13, seed % 2 == 0);
    tile.key = {static_cast<int>(seed % 13), -static_cast<int>(seed), 1 << 30};
    const std::string bytes = Encoded(tile);
    ASSERT_THAT(DecodeMlsTile(bytes), IsOkAndHolds(tile));
    EXPECT_EQ(Encoded(*DecodeMlsTile(bytes)), bytes);
  }
}

TEST(MlsTileCodecTest, PatchesNoJoinMakesRoundTripToo) {
  MlsTile tile;
  Patch patch;  // count 0, sums at their widest
  patch.sum_w = (std::uint64_t{1} << 44) - 1;
  patch.sum_wz = (std::uint64_t{1} << 54) - 1;
  patch.sum_wzz = ~std::uint64_t{0};
  patch.z_min = -kMaxZTicks - 1;
  patch.z_max = kMaxZTicks;
  tile.patches = {patch};
  tile.IndexRows();
  EXPECT_THAT(DecodeMlsTile(Encoded(tile)), IsOkAndHolds(tile));
}

TEST(MlsTileCodecTest, EmptyTileRoundTrips) {
  const MlsTile tile;
  EXPECT_THAT(DecodeMlsTile(Encoded(tile)), IsOkAndHolds(tile));
}

TEST(MlsTileCodecTest, RealTilesRoundTripWithinTheirBound) {
  STRATA_REQUIRE_DATA(path, "nclt_campus_loop");
  const MlsMap map = testing::NcltMap(path, 40);
  std::size_t bytes = 0;
  for (const MlsTile& tile : map.tiles) {
    const std::string encoded = Encoded(tile);
    bytes += encoded.size();
    ASSERT_THAT(DecodeMlsTile(encoded), IsOkAndHolds(tile));
  }
  EXPECT_GT(map.patch_count(), 100'000U);
  EXPECT_LE(static_cast<double>(bytes) / static_cast<double>(map.patch_count()), 9.5);
}

TEST(MlsTileCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(Encoded(RandomTile(5, 300, true)), &DecodeMlsTile, 5, 1000);
}

TEST(MlsTileCodecTest, ForgedBytesNeverCrash) {
  const std::string bytes = Encoded(RandomTile(6, 60, true));
  const int accepted =
      testing::DecodeForgedBodies(BlobKind::kMlsTile, bytes, &DecodeMlsTile, 6, 4000);
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 4000);
}

// What stands behind a vector that is too short must not become bytes of a map.
TEST(MlsTileCodecTest, LayersThatAreNotThoseOfThePatchesAreRefused) {
  const MlsTile tile = RandomTile(7, 100, true);
  ASSERT_FALSE(tile.colour.empty());
  ASSERT_GT(tile.votes.size(), 2U);
  std::vector<MlsTile> wrong(7, tile);
  wrong[0].colour.pop_back();
  wrong[1].colour.push_back({});
  wrong[2].patches.clear();
  wrong[3].votes.back().patch = static_cast<std::uint32_t>(tile.patches.size());
  std::swap(wrong[4].votes.front(), wrong[4].votes.back());
  std::swap(wrong[5].patches.front(), wrong[5].patches.back());
  wrong[6].patches[1] = wrong[6].patches[0];
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    EXPECT_THAT(EncodeMlsTile(wrong[i]),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(tile.key.ToString())))
        << i;
  }
}

TEST(MlsTileCodecTest, WhatNoDecoderTakesIsNotWritten) {
  MlsTile tile;
  tile.key = {0, 7, -3};
  tile.patches.resize(kMaxTilePatches + 1);
  EXPECT_THAT(EncodeMlsTile(tile),
              StatusIs(absl::StatusCode::kResourceExhausted,
                       HasSubstr("tile 0/7/-3 of 4194305 patches; at most 4194304")));
  tile.patches.resize(1);
  tile.votes.resize(kMaxTileVotes + 1);
  EXPECT_THAT(EncodeMlsTile(tile),
              StatusIs(absl::StatusCode::kResourceExhausted,
                       HasSubstr("tile 0/7/-3 of 8388609 votes; at most 8388608")));
}

TEST(MlsTileCodecTest, ATileThatWouldTakeMoreThanItMayIsRefused) {
  const MlsTile tile = RandomTile(5, 4096, true);
  const std::string bytes = Encoded(tile);
  EXPECT_THAT(DecodeMlsTileWithin(std::size_t{1} << 20, bytes), IsOkAndHolds(tile));
  for (const std::size_t bound : {std::size_t{0}, std::size_t{100'000}, std::size_t{250'000}}) {
    EXPECT_FALSE(DecodeMlsTileWithin(bound, bytes).ok()) << bound;
  }
}

// What some hundred bytes announce: four million patches in one cell, eight million votes, and
// columns of one repeated byte each.
TEST(MlsTileCodecTest, AFewBytesThatAnnounceMillionsTakeNoMemory) {
  constexpr std::uint64_t kPatches = kMaxTilePatches;
  constexpr std::uint64_t kVotes = kMaxTileVotes;
  constexpr int kColumns = 24;
  std::string codes(kTileCells * kTileCells / 4, '\0');
  codes[0] = 3;
  std::string rest;
  PutVarint(rest, kPatches - 3);
  std::string body;
  PutTileHeader(body, TileKey{});
  PutColumn(body, codes);
  PutColumn(body, rest);
  PutFixed(body, std::uint8_t{1});
  PutVarint(body, kVotes);
  for (int i = 0; i < kColumns; ++i) PutColumn(body, std::string(kVotes, '\0'));
  PutVarint(body, 0);
  const std::string bytes = SealBlob(BlobKind::kMlsTile, kMlsTileVersion, body);
  ASSERT_LT(bytes.size(), 1000U);
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  EXPECT_THAT(DecodeMlsTileWithin(std::size_t{16} << 20, bytes).status(),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("surfaces")));
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  constexpr long kKilobytes = 4 << 10;
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, kKilobytes);
}

TEST(MlsTileCodecTest, GoldenBytesOfATinyTileDecode) {
  const MlsParameters parameters;
  MlsTile tile;
  tile.key = {0, -1, 2};
  Patch pair = Join(PatchOfMeasurement(0, 100, 90), PatchOfMeasurement(0, 140, 91), parameters);
  tile.patches = {pair, PatchOfMeasurement(1, 120, 92), PatchOfMeasurement(1, 9000, 93)};
  tile.IndexRows();
  // Of version 1: must be readable for ever. (Another zstd release may write other bytes.)
  const std::string golden = absl::HexStringToBytes(
      "534d5431010001006600000000ffffffff02000000028080011228b52ffd00204d00001009000100fb9f07580000"
      "00000003020000000381288e00000000000000015000000000000380020400000000000000010100000000000000"
      "000000000000000000000000000000000004888d580087ef46978e5e5557");
  EXPECT_THAT(DecodeMlsTile(golden), IsOkAndHolds(tile));
}

}  // namespace
}  // namespace strata
