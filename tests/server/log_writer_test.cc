#include "server/log_writer.h"

#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <glog/logging.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/patience.h"

namespace strata::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A hang, not a slow machine.

class LogWriterTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(pipe(pipe_.data()), 0); }
  void TearDown() override {
    for (const int end : pipe_) close(end);
  }
  // Until `what` has come.
  std::string ReadUntil(const std::string& what) const {
    std::string text;
    std::array<char, 4096> some{};
    while (text.find(what) == std::string::npos) {
      const ssize_t size = read(pipe_[0], some.data(), some.size());
      if (size <= 0) break;
      text.append(some.data(), static_cast<std::size_t>(size));
    }
    return text;
  }

  std::array<int, 2> pipe_{};
};

TEST_F(LogWriterTest, WritesWhatIsLogged) {
  const LogWriter writer(pipe_[1]);
  LOG(INFO) << "event=one";
  LOG(ERROR) << "event=two";
  const std::string text = ReadUntil("event=two\n");
  EXPECT_THAT(text, HasSubstr("event=one\n"));
  EXPECT_THAT(text, HasSubstr("log_writer_test.cc:"));
  EXPECT_LT(writer.stuck(), absl::Seconds(60));
}

TEST_F(LogWriterTest, WhatIsLoggedLastIsWrittenBeforeItEnds) {
  {
    const LogWriter writer(pipe_[1]);
    for (int i = 0; i < 100; ++i) LOG(INFO) << "event=last number=" << i;
  }
  EXPECT_THAT(ReadUntil("number=99\n"), HasSubstr("number=0\n"));
}

TEST_F(LogWriterTest, WhoLogsDoesNotWaitForWhoReadsAndIsToldOfWhatIsLost) {
  const LogWriter writer(pipe_[1]);
  const std::string long_line(10'000, 'x');
  for (std::size_t i = 0; i < 2 * LogWriter::kMostBytes / long_line.size(); ++i) {
    LOG(INFO) << long_line;
  }
  EXPECT_GT(writer.dropped(), 0U);
  const absl::Time until = absl::Now() + testing::kPatience;
  while (writer.stuck() < absl::Milliseconds(200) && absl::Now() < until) {
    absl::SleepFor(absl::Milliseconds(10));
  }
  EXPECT_GE(writer.stuck(), absl::Milliseconds(200));
  EXPECT_THAT(ReadUntil("event=log dropped="), HasSubstr("event=log dropped="));
}

}  // namespace
}  // namespace strata::server
