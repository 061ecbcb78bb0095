#include "core/mls/patch.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::Uniform;

TEST(SigmaCodeTest, IsTheLogarithmicScale) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double sigma_m = std::pow(10.0, Uniform(random, -4, 1));
    const double exact = std::log2(sigma_m / 0.002) * 255 / 8;
    if (std::abs(exact - std::floor(exact) - 0.5) < 1e-9) continue;  // either neighbour is right
    const int expected = exact <= 0 ? 0 : exact >= 255 ? 255 : static_cast<int>(std::lround(exact));
    ASSERT_EQ(SigmaCode(sigma_m), expected) << sigma_m;
  }
  EXPECT_EQ(SigmaCode(0.0), 0);
  EXPECT_EQ(SigmaCode(1e9), 255);
}

TEST(SigmaCodeTest, CodesRoundTripAndWeightsAreFarFromTies) {
  for (int code = 0; code < 256; ++code) {
    const auto c = static_cast<std::uint8_t>(code);
    EXPECT_EQ(SigmaCode(SigmaOfCode(c)), code);
    EXPECT_NEAR(SigmaOfCode(c) / (0.002 * std::pow(2.0, code * 8.0 / 255)), 1.0, 1e-12);
    const double weight = 65536.0 * std::pow(2.0, -code * 16.0 / 255);
    EXPECT_EQ(WeightOfCode(c), static_cast<std::uint32_t>(std::lround(weight)));
    // No machine's last bit can move a weight.
    EXPECT_GT(std::abs(weight - std::floor(weight) - 0.5), 1e-6) << code;
    if (code > 0) {
      EXPECT_EQ(SigmaCode(SigmaCodeBoundary(c)), code);
      EXPECT_EQ(SigmaCode(std::nextafter(SigmaCodeBoundary(c), 0.0)), code - 1);
    }
  }
  EXPECT_EQ(WeightOfCode(0), 65536U);
  EXPECT_EQ(WeightOfCode(255), 1U);
}

// The words are part of the file format.
TEST(PatchTest, LayoutIsTheDocumentedOne) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 1000; ++i) {
    PatchFields f;
    f.sum_wzz = random();
    f.sum_wz = random() >> 10;
    f.sum_w = random() >> 20;
    f.count = static_cast<std::uint32_t>(random() >> 44);
    f.z_min = static_cast<std::int32_t>(random() >> 40) - (1 << 23);
    f.z_max = static_cast<std::int32_t>(random() >> 40) - (1 << 23);
    f.cell = static_cast<std::uint16_t>(random());
    f.top_sigma_code = static_cast<std::uint8_t>(random());
    Patch stored;
    StorePatch(f, stored);
    Patch set;
    set.sum_wzz = f.sum_wzz;
    set.sum_wz = f.sum_wz;
    set.sum_w = f.sum_w;
    set.count = f.count;
    set.z_min = f.z_min;
    set.z_max = f.z_max;
    set.cell = f.cell;
    set.top_sigma_code = f.top_sigma_code;
    ASSERT_TRUE(stored == set);
    const auto words = std::bit_cast<std::array<std::uint64_t, 4>>(stored);
    ASSERT_EQ(words[1], f.sum_wz | std::uint64_t{f.top_sigma_code} << 54);
    ASSERT_EQ(words[3] & 0xFFFF, f.cell);
  }
}

TEST(PatchTest, MeanSigmaAndSpreadAreThoseOfTheMeasurements) {
  const MlsParameters parameters;
  Patch patch = PatchOfMeasurement(7, 4096, 40);
  EXPECT_DOUBLE_EQ(patch.mean_m(), 1.0);
  EXPECT_NEAR(patch.sigma_m() / SigmaOfCode(40), 1.0, 1e-4);
  EXPECT_EQ(patch.spread_m(), 0.0);
  JoinInto(patch, PatchOfMeasurement(7, 4096 + 200, 40), parameters);
  EXPECT_DOUBLE_EQ(patch.mean_m(), 1.0 + 100.0 / 4096);
  EXPECT_NEAR(patch.spread_m(), 100.0 / 4096, 1e-12);
  EXPECT_NEAR(patch.sigma_m() / SigmaOfCode(40), std::sqrt(0.5), 1e-4);
  EXPECT_EQ(patch.depth_m(), 0.0);
  JoinInto(patch, PatchOfMeasurement(7, 6144, 90), parameters);
  EXPECT_TRUE(patch.vertical());
  EXPECT_DOUBLE_EQ(patch.mean_m(), 1.5);
  EXPECT_DOUBLE_EQ(patch.depth_m(), 0.5);
  EXPECT_DOUBLE_EQ(patch.sigma_m(), SigmaOfCode(90));
}

TEST(PatchTest, TouchingIsCloserThanTheGap) {
  const MlsParameters parameters{.gap_size_m = 1.0};
  const Patch low = PatchOfMeasurement(0, 0, 0);
  EXPECT_TRUE(Touching(low, PatchOfMeasurement(0, 4095, 0), parameters));
  EXPECT_FALSE(Touching(low, PatchOfMeasurement(0, 4096, 0), parameters));
  EXPECT_FALSE(Touching(PatchOfMeasurement(0, 4096, 0), low, parameters));
}

TEST(PatchTest, FullPatchesJoinToFullOnes) {
  // Doubling a two-height patch until Σw reaches its bound: it stays there, in either order.
  const MlsParameters parameters;
  const std::uint64_t bound = MaxWeightSum(parameters.thickness_ticks());
  Patch patch = Join(PatchOfMeasurement(0, 0, 0), PatchOfMeasurement(0, 300, 0), parameters);
  for (int i = 0; i < 40; ++i) patch = Join(patch, patch, parameters);
  EXPECT_EQ(patch.sum_w, bound);
  EXPECT_EQ(patch.count, Patch::kMaxCount);
  EXPECT_NEAR(patch.mean_m(), 150.0 / 4096, 1e-12);
  const Patch one = PatchOfMeasurement(0, 10, 3);
  EXPECT_TRUE(Join(patch, one, parameters) == Join(one, patch, parameters));
  EXPECT_EQ(Join(patch, one, parameters).sum_wz, 0U);
}

}  // namespace
}  // namespace strata
