#include "core/codec/columns.h"

#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

TEST(ColumnTest, EveryPackingRoundTrips) {
  std::mt19937 random(1);
  std::string noise;
  for (int i = 0; i < 1000; ++i) noise.push_back(static_cast<char>(random()));
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "abc";
  for (const std::string& bytes :
       {std::string(), std::string("x"), std::string(500, 'y'), noise, text}) {
    std::string out;
    PutColumn(out, bytes);
    EXPECT_LE(out.size(), bytes.size() + 4);
    ByteReader reader(out);
    std::string read;
    STRATA_EXPECT_OK(TakeColumn(reader, bytes.size(), read));
    EXPECT_EQ(read, bytes);
    EXPECT_EQ(reader.remaining(), 0U);
  }
}

TEST(ColumnTest, AnnouncedSizeBeyondTheBoundIsDataLossBeforeAllocation) {
  std::string bomb;
  bomb.push_back('\1');
  PutVarint(bomb, std::uint64_t{1} << 60);
  bomb.push_back('x');
  ByteReader reader(bomb);
  std::string read;
  EXPECT_THAT(TakeColumn(reader, 1000, read),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("at most 1000")));
}

TEST(ColumnsTest, NumbersOfEveryWidthRoundTrip) {
  std::mt19937_64 random(2);
  std::vector<std::uint64_t> values = {
      0, 127, 128, 191, 192, std::numeric_limits<std::uint64_t>::max()};
  for (int i = 0; i < 2000; ++i) values.push_back(random() >> (random() % 64));
  ColumnEncoder encoder(3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    encoder.Code(i % 2, values[i]);
    encoder.CodeRelative(1, static_cast<std::int64_t>(values[i]), -12345);
    encoder.CodeBit(2, values[i] % 3 == 0);
  }
  std::string out;
  encoder.Finish(out);
  ByteReader reader(out);
  STRATA_ASSERT_OK_AND_ASSIGN(ColumnDecoder decoder, ColumnDecoder::Open(reader, 3, 10'000));
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(decoder.Code(i % 2, 0), values[i]);
    EXPECT_EQ(decoder.CodeRelative(1, 0, -12345), static_cast<std::int64_t>(values[i]));
    EXPECT_EQ(decoder.CodeBit(2, false), values[i] % 3 == 0);
  }
  STRATA_EXPECT_OK(decoder.Finish());
}

TEST(ColumnsTest, ReadingTooFewOrTooManyIsDataLoss) {
  ColumnEncoder encoder(1);
  for (std::uint64_t value : {1, 2, 1'000'000}) encoder.Code(0, value);
  std::string out;
  encoder.Finish(out);
  for (int reads : {2, 4}) {
    ByteReader reader(out);
    STRATA_ASSERT_OK_AND_ASSIGN(ColumnDecoder decoder, ColumnDecoder::Open(reader, 1, 10));
    for (int i = 0; i < reads; ++i) decoder.Code(0, 0);
    EXPECT_THAT(decoder.Finish(), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("numbers")));
  }
}

}  // namespace
}  // namespace strata
