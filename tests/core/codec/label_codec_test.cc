#include "core/codec/label_codec.h"

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

std::vector<std::uint16_t> RandomLabels(std::size_t count, int most, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::uint16_t> labels(count);
  for (std::uint16_t& label : labels) label = static_cast<std::uint16_t>(random() % (most + 1));
  return labels;
}

TEST(LabelCodecTest, RoundTripsExactly) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{70'000}}) {
    for (const int most : {0, 3, 255, 65535}) {
      const auto labels = RandomLabels(count, most, 1);
      EXPECT_THAT(DecodeLabels(EncodeLabels(labels)), IsOkAndHolds(labels)) << count << " " << most;
    }
  }
}

TEST(LabelCodecTest, TheLargestPieceStaysBelowAMebibyteAndFewClassesTakeFewBytes) {
  EXPECT_LE(EncodeLabels(RandomLabels(kMaxEncodedLabels, 65535, 2)).size(), 1U << 20);
  std::vector<std::uint16_t> runs(kMaxEncodedLabels);
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i] = static_cast<std::uint16_t>(i / 1000 % 4);
  EXPECT_LE(EncodeLabels(runs).size(), 4000U);
}

TEST(LabelCodecTest, DamageIsDataLoss) {
  const auto decode = [](absl::string_view bytes) { return DecodeLabels(bytes); };
  const std::string bytes = EncodeLabels(RandomLabels(3000, 300, 3));
  ExpectDamageIsDataLoss(bytes, decode, 4, 300);
  DecodeForgedBodies(BlobKind::kLabels, bytes, decode, 5, 3000);
}

}  // namespace
}  // namespace strata::testing
