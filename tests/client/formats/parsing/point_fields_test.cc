#include "client/formats/parsing/point_fields.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/scalar.h"
#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
// More than are read at a time, so that what is rare happens behind what is not.
constexpr std::size_t kPoints = 1300;

// Records of floats: point i is at (i, 0, 1); every other field has the value i, too.
class Records {
 public:
  explicit Records(std::vector<Meaning> meanings)
      : meanings_(std::move(meanings)), values_(kPoints * meanings_.size()) {
    for (std::size_t i = 0; i < kPoints; ++i) {
      for (std::size_t k = 0; k < meanings_.size(); ++k) at(i, k) = static_cast<float>(i);
      at(i, 1) = 0.0F;
      at(i, 2) = 1.0F;
    }
  }
  float& at(std::size_t point, std::size_t field) {
    return values_[point * meanings_.size() + field];
  }
  absl::StatusOr<PointCloud> Read(std::uint32_t rows = 0) const {
    STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(meanings_));
    if (rows != 0) builder.SetGrid(rows, kPoints / rows);
    std::vector<PointField> fields;
    for (std::size_t k = 0; k < meanings_.size(); ++k) {
      fields.push_back({.meaning = meanings_[k],
                        .type = ScalarType::kFloat32,
                        .first = reinterpret_cast<const char*>(values_.data() + k),
                        .stride = sizeof(float) * meanings_.size()});
    }
    AddPoints(fields, kPoints, false, builder);
    return std::move(builder).Build();
  }

 private:
  std::vector<Meaning> meanings_;
  std::vector<float> values_;
};

Records WithIntensity() {
  using enum Meaning;
  return Records({kX, kY, kZ, kIntensity, kLabel});
}

TEST(PointFieldsTest, PointsThatAreNotFiniteGoWithTheirColumns) {
  Records records = WithIntensity();
  for (const std::size_t hole : {0U, 511U, 512U, 700U, 1299U}) records.at(hole, hole % 3) = kNan;
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, records.Read());
  ASSERT_EQ(cloud.size(), kPoints - 5);
  ASSERT_EQ(cloud.intensity.size(), cloud.size());
  ASSERT_EQ(cloud.label.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_EQ(cloud.points[i].tail<2>(), Eigen::Vector2f(0, 1));
    ASSERT_EQ(cloud.points[i].x(), cloud.intensity[i]);
    ASSERT_EQ(cloud.points[i].x(), cloud.label[i]);
  }
  EXPECT_EQ(cloud.points[510].x(), 513.0F);
}

TEST(PointFieldsTest, InAGridTheyAreHolesThatKeepTheirColumns) {
  Records records = WithIntensity();
  records.at(600, 2) = std::numeric_limits<float>::infinity();
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, records.Read(13));
  ASSERT_EQ(cloud.size(), kPoints);
  EXPECT_TRUE(cloud.points[600].array().isNaN().all());
  EXPECT_EQ(cloud.intensity[600], 600.0F);
  EXPECT_EQ(cloud.points[601], Eigen::Vector3f(601, 0, 1));
}

TEST(PointFieldsTest, AFarPointIsNamedWhereverItStands) {
  Records records = WithIntensity();
  records.at(1000, 1) = -3e6F;
  EXPECT_THAT(records.Read(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("(1000, -3e+06, 1)")));
}

TEST(PointFieldsTest, FloatsFarAwayComeBackFromTheirOrigin) {
  Records records = WithIntensity();
  for (std::size_t i = 0; i < kPoints; ++i) records.at(i, 1) = 5'000'000.0F + 0.5F * (i % 7);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, records.Read());
  EXPECT_EQ(cloud.origin, Eigen::Vector3d(0, 5'000'000, 0));
  for (std::size_t i = 0; i < kPoints; ++i) ASSERT_EQ(cloud.points[i].y(), 0.5F * (i % 7));
}

TEST(PointFieldsTest, LateFractionsMakeFractionsOfAllColours) {
  using enum Meaning;
  Records records({kX, kY, kZ, kRed, kGreen, kBlue});
  for (std::size_t i = 0; i < kPoints; ++i) {
    for (std::size_t k = 3; k < 6; ++k) records.at(i, k) = i < 1200 ? 1.0F : 0.5F;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, records.Read());
  ASSERT_EQ(cloud.colour.size(), kPoints);
  EXPECT_EQ(cloud.colour[0], (Colour{255, 255, 255}));
  EXPECT_EQ(cloud.colour[1299], (Colour{128, 128, 128}));
  records.at(1250, 4) = 2.0F;  // no fractions of one, then
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud bytes, records.Read());
  EXPECT_EQ(bytes.colour[0], (Colour{1, 1, 1}));
}

TEST(PointFieldsTest, LateFractionsMakeLabelsNone) {
  Records records = WithIntensity();
  records.at(1299, 4) = 7.5F;
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, records.Read());
  EXPECT_TRUE(cloud.label.empty());
}

template <typename T>
void ExpectReads(ScalarType type, T value) {
  for (const bool big_endian : {false, true}) {
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian != (std::endian::native == std::endian::big)) {
      std::reverse(bytes.begin(), bytes.end());
    }
    const std::string record = "_" + std::string(bytes.begin(), bytes.end()) + "_";
    const std::string records = record + record;
    std::vector<double> values(2);
    ReadScalars(records.data() + 1, record.size(), type, big_endian, values);
    EXPECT_THAT(values, ::testing::Each(static_cast<double>(value)));
    EXPECT_EQ(ScalarAt(records.data() + 1, type, big_endian), static_cast<double>(value));
  }
}

TEST(ScalarTest, EveryTypeReadsInBothByteOrders) {
  ExpectReads<std::int8_t>(ScalarType::kInt8, -7);
  ExpectReads<std::uint8_t>(ScalarType::kUint8, 250);
  ExpectReads<std::int16_t>(ScalarType::kInt16, -1234);
  ExpectReads<std::uint16_t>(ScalarType::kUint16, 54321);
  ExpectReads<std::int32_t>(ScalarType::kInt32, -12345678);
  ExpectReads<std::uint32_t>(ScalarType::kUint32, 4123456789U);
  ExpectReads<std::int64_t>(ScalarType::kInt64, -1234567890123);
  ExpectReads<std::uint64_t>(ScalarType::kUint64, 0xFEDCBA9876543210U);
  ExpectReads<float>(ScalarType::kFloat32, -1.5e-3F);
  ExpectReads<double>(ScalarType::kFloat64, 512345.678);
}

TEST(PackedColourTest, AnOpacityLeavesTheColourAsItIs) {
  constexpr std::uint32_t kOpaque = 0xFFA01020;  // as a float a NaN that signals
  std::string bytes(16, '\0');
  std::memcpy(bytes.data() + 12, &kOpaque, sizeof kOpaque);
  STRATA_ASSERT_OK_AND_ASSIGN(
      CloudBuilder builder,
      CloudBuilder::Create({Meaning::kX, Meaning::kY, Meaning::kZ, Meaning::kPackedColour}));
  std::vector<PointField> fields;
  for (std::size_t k = 0; k < 4; ++k) {
    fields.push_back({.meaning = k < 3 ? static_cast<Meaning>(k) : Meaning::kPackedColour,
                      .type = ScalarType::kFloat32,
                      .first = bytes.data() + 4 * k,
                      .stride = bytes.size()});
  }
  AddPoints(fields, 1, false, builder);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, std::move(builder).Build());
  EXPECT_THAT(cloud.colour, ::testing::ElementsAre(Colour{0xA0, 0x10, 0x20}));
}

}  // namespace
}  // namespace strata
