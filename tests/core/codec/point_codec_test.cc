#include "core/codec/point_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "tests/core/codec/hostile.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

// Floats of any bits, infinities and NaN with it; `columns` chooses the optional ones.
PointCloud RandomChunk(std::uint64_t seed, std::size_t n, unsigned columns) {
  std::mt19937_64 random(seed);
  const auto any_float = [&] { return std::bit_cast<float>(static_cast<std::uint32_t>(random())); };
  PointCloud chunk;
  for (std::size_t i = 0; i < n; ++i) {
    chunk.points.emplace_back(any_float(), any_float(), any_float());
    if ((columns & 1) != 0) chunk.intensity.push_back(any_float());
    if ((columns & 2) != 0) {
      chunk.colour.push_back({static_cast<std::uint8_t>(random()),
                              static_cast<std::uint8_t>(random()),
                              static_cast<std::uint8_t>(random())});
    }
    if ((columns & 4) != 0) chunk.label.push_back(static_cast<std::uint16_t>(random()));
  }
  return chunk;
}

// Same bits, or both not a number.
bool Same(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

void ExpectSame(const PointCloud& a, const PointCloud& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(a.intensity.size(), b.intensity.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(Same(a.points[i][k], b.points[i][k])) << i;
  }
  for (std::size_t i = 0; i < a.intensity.size(); ++i) {
    ASSERT_TRUE(Same(a.intensity[i], b.intensity[i])) << i;
  }
  EXPECT_EQ(a.colour, b.colour);
  EXPECT_EQ(a.label, b.label);
}

TEST(PointCodecTest, RandomChunksRoundTripBitForBit) {
  for (unsigned columns = 0; columns < 8; ++columns) {
    SCOPED_TRACE(columns);
    for (const std::size_t n : {0, 1, 7, 3000}) {
      const PointCloud chunk = RandomChunk(columns + n, n, columns);
      STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, EncodePoints(chunk));
      STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud read, DecodePoints(bytes));
      ExpectSame(read, chunk);
      EXPECT_EQ(*EncodePoints(read), bytes);
    }
  }
}

TEST(PointCodecTest, LargestNoisyChunkStaysBelowOneMebibyte) {
  const PointCloud chunk = RandomChunk(9, kMaxEncodedPoints, 7);
  EXPECT_LE(EncodePoints(chunk)->size(), 21 * kMaxEncodedPoints + 256);
  EXPECT_LT(EncodePoints(chunk)->size(), 1U << 20);
}

TEST(PointCodecTest, AnyNanBecomesTheSameNan) {
  PointCloud a;
  a.points = {{std::bit_cast<float>(0xFFC12345U), 0.0F, -0.0F}};
  PointCloud b;
  b.points = {{std::numeric_limits<float>::quiet_NaN(), 0.0F, -0.0F}};
  EXPECT_EQ(*EncodePoints(a), *EncodePoints(b));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud read, DecodePoints(*EncodePoints(a)));
  EXPECT_TRUE(std::signbit(read.points[0].z()));
}

TEST(PointCodecTest, RealScanShrinksToHalf) {
  STRATA_REQUIRE_DATA(path, "nclt_campus_loop");
  PointCloud chunk;
  chunk.points = testing::ReadPlainPcd(path / "scans" / "s000.pcd");
  chunk.points.resize(std::min(chunk.points.size(), kMaxEncodedPoints));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, EncodePoints(chunk));
  EXPECT_LT(bytes.size(), 6 * chunk.size());
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud read, DecodePoints(bytes));
  ExpectSame(read, chunk);
}

TEST(PointCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(*EncodePoints(RandomChunk(3, 100, 7)), &DecodePoints, 3, 1000);
}

TEST(PointCodecTest, ForgedBytesNeverCrash) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, EncodePoints(RandomChunk(4, 10, 7)));
  const int accepted =
      testing::DecodeForgedBodies(BlobKind::kPoints, bytes, &DecodePoints, 4, 4000);
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 4000);
}

TEST(PointCodecTest, TooManyPointsAreRefusedBeforeAllocation) {
  std::string body;
  PutVarint(body, kMaxEncodedPoints + 1);
  body.push_back('\0');
  EXPECT_THAT(DecodePoints(SealBlob(BlobKind::kPoints, 1, body)),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("40001")));
}

TEST(PointCodecTest, ColumnsThatDoNotFitAreRefused) {
  for (const unsigned column : {1U, 2U, 4U}) {
    for (const std::size_t entries : {1, 9, 11}) {
      PointCloud chunk = RandomChunk(5, 10, column);
      if (column == 1) chunk.intensity.resize(entries);
      if (column == 2) chunk.colour.resize(entries);
      if (column == 4) chunk.label.resize(entries);
      EXPECT_THAT(EncodePoints(chunk),
                  StatusIs(absl::StatusCode::kInvalidArgument,
                           HasSubstr(absl::StrCat(entries, " entries for 10 points"))));
    }
  }
  EXPECT_THAT(EncodePoints(RandomChunk(6, kMaxEncodedPoints + 1, 0)),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("40001")));
}

TEST(PointCodecTest, TinyChunkHasGoldenBytes) {
  PointCloud chunk;
  chunk.points = {{1.0F, -2.0F, 0.5F}, {1.5F, -2.0F, 0.25F}};
  chunk.label = {7, 7};
  EXPECT_EQ(
      absl::BytesToHexString(*EncodePoints(chunk)),
      "53505431010001003700000002040102000102000002008000027f000002ff000002ff000002ff0000027f0000"
      "0200ff000200ff000200ff00027e0000020e0001020080b156cbd5b20cf1");
}

}  // namespace
}  // namespace strata
