#include "server/rpc/reader_pace.h"

#include "absl/time/time.h"
#include <gtest/gtest.h>

namespace strata::server {
namespace {

constexpr absl::Duration kLimit = absl::Seconds(30);

TEST(ReaderPaceTest, WhoTakesNothingHasTheWholeLimit) {
  EXPECT_EQ(ReaderPace(kLimit).patience(), kLimit);
}

TEST(ReaderPaceTest, AMessageNowAndThenIsNotEnough) {
  ReaderPace pace(kLimit);
  int messages = 0;
  for (; pace.patience() > absl::Seconds(20) && messages < 1000; ++messages) {
    pace.Took(1000, absl::Seconds(5));
  }
  EXPECT_EQ(messages, 3);
}

TEST(ReaderPaceTest, ASteadyReaderIsNeverBehind) {
  ReaderPace pace(kLimit);
  for (int i = 0; i < 1000; ++i) {
    pace.Took(20 * ReaderPace::kLeastBytesPerSecond, absl::Seconds(20));
    EXPECT_EQ(pace.patience(), kLimit);
  }
}

TEST(ReaderPaceTest, WhatWasFastCountsForNothingLater) {
  ReaderPace pace(kLimit);
  pace.Took(std::size_t{1} << 30, absl::Seconds(1));
  EXPECT_EQ(pace.patience(), kLimit);
}

TEST(ReaderPaceTest, WhoCatchesUpIsForgiven) {
  ReaderPace pace(kLimit);
  pace.Took(0, absl::Seconds(25));
  EXPECT_EQ(pace.patience(), absl::Seconds(5));
  pace.Took(20 * ReaderPace::kLeastBytesPerSecond, absl::ZeroDuration());
  EXPECT_EQ(pace.patience(), absl::Seconds(25));
}

}  // namespace
}  // namespace strata::server
