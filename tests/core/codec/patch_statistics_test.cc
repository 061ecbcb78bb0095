#include "core/codec/patch_statistics.h"

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/patch.h"

namespace strata {
namespace {

Patch PatchOf(std::mt19937_64& random, int measurements, int thickness_ticks) {
  const MlsParameters parameters;
  Patch patch;
  for (int i = 0; i < measurements; ++i) {
    const auto z = static_cast<std::int32_t>(random() % thickness_ticks) - 5000;
    const Patch one = PatchOfMeasurement(7, z, static_cast<std::uint8_t>(random() % 256));
    patch = i == 0 ? one : Join(patch, one, parameters);
  }
  return patch;
}

TEST(PatchStatisticsTest, FewMeasurementsImplyAllSums) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 3000; ++i) {
    const int count = 1 + i % 3;
    const Patch patch = PatchOf(random, count, 400);
    OtherMeasurements others;
    const PatchShape shape = ShapeOf(patch, others);
    const bool tie_at_the_bottom = count == 3 && shape == PatchShape::kSums;
    if (!tie_at_the_bottom) {
      EXPECT_EQ(shape,
                count == 1   ? PatchShape::kSingle
                : count == 2 ? PatchShape::kPair
                             : PatchShape::kTriple);
    }
    Patch implied = patch;
    implied.sum_w = implied.sum_wz = implied.sum_wzz = 0;
    if (shape == PatchShape::kSums) continue;
    ImplySums(shape, others, implied);
    EXPECT_EQ(implied, patch);
  }
}

TEST(PatchStatisticsTest, TallPatchesAreVertical) {
  std::mt19937_64 random(2);
  Patch patch = PatchOf(random, 12, 3000);
  ASSERT_TRUE(patch.vertical());
  OtherMeasurements others;
  EXPECT_EQ(ShapeOf(patch, others), PatchShape::kVertical);
  patch.sum_wz = 1;  // no patch a join makes: kept as it is all the same
  EXPECT_EQ(ShapeOf(patch, others), PatchShape::kSums);
}

TEST(PatchStatisticsTest, ExpectationsAreNear) {
  std::mt19937_64 random(3);
  double expected_over_true = 0;
  constexpr int kPatches = 500;
  for (int i = 0; i < kPatches; ++i) {
    const Patch patch = PatchOf(random, 30, 400);
    expected_over_true +=
        static_cast<double>(ExpectedSumWzz(patch)) / static_cast<double>(patch.sum_wzz);
    // Cauchy and Schwarz: what is expected is the least that is possible.
    EXPECT_LE(ExpectedSumWzz(patch), patch.sum_wzz + 2 * patch.sum_w);
  }
  EXPECT_GT(expected_over_true / kPatches, 0.5);
}

}  // namespace
}  // namespace strata
