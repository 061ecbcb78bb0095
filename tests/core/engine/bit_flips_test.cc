// A seeded sample of bits that flip in a closed map's file; tests/experiments/disk_campaign has
// more.
#include "tests/core/engine/bit_flips.h"

#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::IsEmpty;

constexpr std::uint64_t kSeed = 20261122;

class BitFlipTest : public ::testing::TestWithParam<bool> {};

TEST_P(BitFlipTest, ABitIsTheDamageOfItsThingAlone) {
  SCOPED_TRACE(kSeed);
  STRATA_ASSERT_OK_AND_ASSIGN(const BitFlips flips, BitFlips::Prepare(GetParam()));
  FlipResult result;
  int blobs = 0;
  for (const FlipKind& kind : flips.kinds()) {
    if (!kind.blob || (!GetParam() && kind.table != "truth_local_map")) continue;
    ++blobs;
    flips.FlipIn(kind, kSeed, result);
  }
  EXPECT_EQ(blobs, GetParam() ? 19 : 1);
  for (std::uint64_t i = 0; i < 4; ++i) flips.FlipAnywhere(kSeed + i, result);
  EXPECT_GT(result.trials, blobs);
  EXPECT_THAT(result.violations, IsEmpty());
}

// Among these seeds are bits that take a tile's key out of the range of keys.
TEST(BitFlip, ARebuildMendsTheKeysOfTiles) {
  STRATA_ASSERT_OK_AND_ASSIGN(const BitFlips flips, BitFlips::Prepare(true));
  FlipResult result;
  for (const FlipKind& kind : flips.kinds()) {
    if (kind.table != "derived_mls_tile" || (kind.column != "level" && kind.column != "x"))
      continue;
    for (std::uint64_t seed = 1135; seed < 1145; ++seed) flips.FlipIn(kind, seed, result);
  }
  EXPECT_EQ(result.trials, 20);
  EXPECT_THAT(result.violations, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Maps, BitFlipTest, ::testing::Bool(), [](const auto& points) {
  return points.param ? "ThatKeepPoints" : "ThatDropPoints";
});

}  // namespace
}  // namespace strata::testing
