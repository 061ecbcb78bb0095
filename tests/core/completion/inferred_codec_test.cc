#include "core/completion/inferred_codec.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;

TEST(InferredCodecTest, ComesBack) {
  InferredPart part{12, 0x123456789abc, 400, 3, {}};
  for (int i = 0; i < 50; ++i) part.points.emplace_back(1e5 + 0.25 * i, -3.5, 0.125 * i);
  STRATA_ASSERT_OK_AND_ASSIGN(const InferredPart back,
                              DecodeInferredPart(EncodeInferredPart(part)));
  EXPECT_EQ(back.entity, part.entity);
  EXPECT_EQ(back.kind, part.kind);
  EXPECT_EQ(back.agreeing, part.agreeing);
  EXPECT_EQ(back.contradicting, part.contradicting);
  ASSERT_EQ(back.points.size(), part.points.size());
  for (std::size_t i = 0; i < part.points.size(); ++i) {
    EXPECT_LT((back.points[i] - part.points[i]).norm(), 1e-4);
  }
  const InferredPart none{1, 2, 0, 0, {}};
  EXPECT_EQ(*DecodeInferredPart(EncodeInferredPart(none)), none);

  InferredInfo info;
  info.job = 3;
  info.epoch = 2;
  info.made = absl::FromUnixMicros(1'700'000'000'123'456);
  info.kinds = 4;
  info.entities = 12;
  info.points = 70'000;
  STRATA_ASSERT_OK_AND_ASSIGN(const InferredInfo head,
                              DecodeInferredInfo(EncodeInferredInfo(info)));
  EXPECT_EQ(EncodeInferredInfo(head), EncodeInferredInfo(info));
}

TEST(InferredCodecTest, DamageIsDataLoss) {
  InferredPart part{12, 70, 400, 3, {{1, 2, 3}, {1, 2, 4}}};
  testing::ExpectDamageIsDataLoss(EncodeInferredPart(part), &DecodeInferredPart, 5, 300);
  testing::ExpectDamageIsDataLoss(EncodeInferredInfo({}), &DecodeInferredInfo, 5, 300);
  for (const double bad : {1e30, std::numeric_limits<double>::quiet_NaN()}) {
    part.points[0].x() = bad;
    EXPECT_THAT(DecodeInferredPart(EncodeInferredPart(part)),
                StatusIs(absl::StatusCode::kDataLoss, _));
  }
}

}  // namespace
}  // namespace strata
