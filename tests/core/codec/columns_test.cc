#include "core/codec/columns.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <map>
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
    for (const auto put : {&PutColumn, &PutNoisyColumn}) {
      std::string out;
      put(out, bytes);
      EXPECT_LE(out.size(), bytes.size() + 4);
      ByteReader reader(out);
      std::string read;
      STRATA_EXPECT_OK(TakeColumn(reader, bytes.size(), read));
      EXPECT_EQ(read, bytes);
      EXPECT_EQ(reader.remaining(), 0U);
    }
  }
}

TEST(ColumnTest, NoiseTakesItsEntropyAndRepeatedNoiseLess) {
  constexpr unsigned kSeed = 3;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937 random(kSeed);
  std::geometric_distribution<int> skewed(0.1);
  std::string noise;
  std::map<char, double> count;
  for (int i = 0; i < 30'000; ++i) {
    noise.push_back(static_cast<char>(skewed(random)));
    ++count[noise.back()];
  }
  double entropy_bits = 0.0;
  for (const auto& [byte, n] : count) {
    entropy_bits -= n * std::log2(n / static_cast<double>(noise.size()));
  }
  std::string out;
  PutNoisyColumn(out, noise);
  EXPECT_GE(static_cast<double>(out.size()), entropy_bits / 8.0);
  EXPECT_LE(static_cast<double>(out.size()), 1.02 * entropy_bits / 8.0 + 200.0);

  std::string repeated;
  while (repeated.size() < noise.size()) repeated += noise.substr(0, 300);
  out.clear();
  PutNoisyColumn(out, repeated);
  EXPECT_LT(out.size(), 1000U);
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
