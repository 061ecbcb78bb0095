#include "proto/translate/points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/scans.h"
#include "tests/support/status_matchers.h"

namespace strata::translate {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;

PointCloud FullCloud() {
  PointCloud cloud;
  cloud.points = {{1.5F, -2.0F, 3.25F}, {4.0F, 5.0F, -6.0F}};
  cloud.intensity = {0.25F, 1e9F};
  cloud.colour = {{1, 2, 3}, {253, 254, 255}};
  cloud.label = {0, 65535};
  return cloud;
}

TEST(TranslatePointsTest, ColumnsAreLittleEndianAsDocumented) {
  const v1::PointChunk chunk = ToProto(FullCloud());
  EXPECT_EQ(chunk.xyz().substr(0, 4), std::string("\x00\x00\xC0\x3F", 4));  // 1.5F
  EXPECT_EQ(chunk.rgb(), "\x01\x02\x03\xFD\xFE\xFF");
  EXPECT_EQ(chunk.label(), std::string("\x00\x00\xFF\xFF", 4));
}

TEST(TranslatePointsTest, EveryColumnComesBack) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud back, FromProto(ToProto(FullCloud())));
  EXPECT_EQ(back.points, FullCloud().points);
  EXPECT_EQ(back.intensity, FullCloud().intensity);
  EXPECT_EQ(back.colour, FullCloud().colour);
  EXPECT_EQ(back.label, FullCloud().label);
}

TEST(TranslatePointsTest, AFullChunkFitsOneMebibyte) {
  PointCloud cloud;
  cloud.points.resize(api::kMaxPointsPerChunk);
  cloud.intensity.resize(api::kMaxPointsPerChunk);
  cloud.colour.resize(api::kMaxPointsPerChunk);
  cloud.label.resize(api::kMaxPointsPerChunk);
  EXPECT_LE(ToProto(cloud).ByteSizeLong(), std::size_t{1} << 20);
  cloud.points.resize(api::kMaxPointsPerChunk + 1);
  cloud.intensity.clear();
  cloud.colour.clear();
  cloud.label.clear();
  EXPECT_THAT(FromProto(ToProto(cloud)), StatusIs(kInvalid, HasSubstr("40001 points")));
}

TEST(TranslatePointsTest, RefusesColumnsOfWrongLength) {
  const auto refused = [](const auto& spoil, const char* message) {
    v1::PointChunk chunk = ToProto(FullCloud());
    spoil(chunk);
    EXPECT_THAT(FromProto(chunk), StatusIs(kInvalid, HasSubstr(message)));
  };
  refused([](auto& c) { c.mutable_xyz()->pop_back(); }, "xyz has 23 bytes");
  refused([](auto& c) { c.clear_xyz(); }, "chunk has 0 points");
  refused([](auto& c) { c.mutable_intensity()->push_back('x'); }, "intensity has 9 bytes");
  refused([](auto& c) { c.mutable_rgb()->pop_back(); }, "rgb has 5 bytes");
  refused([](auto& c) { c.mutable_label()->pop_back(); }, "label has 3 bytes");
}

}  // namespace
}  // namespace strata::translate
