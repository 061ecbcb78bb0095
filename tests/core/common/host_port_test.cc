#include "core/common/host_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

TEST(HostPortTest, WritesWhatItReads) {
  for (const char* text : {"127.0.0.1:50051", "[::1]:0", "localhost:1", "robot.example:65535"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const HostPort address, ParseHostPort(text));
    EXPECT_EQ(address.ToString(), text);
  }
}

TEST(HostPortTest, KnowsLoopback) {
  const auto loopback = [](const char* text) { return ParseHostPort(text)->loopback(); };
  EXPECT_TRUE(loopback("127.0.0.1:1"));
  EXPECT_TRUE(loopback("127.9.9.9:1"));
  EXPECT_TRUE(loopback("[::1]:1"));
  EXPECT_TRUE(loopback("localhost:1"));
  EXPECT_FALSE(loopback("0.0.0.0:1"));
  EXPECT_FALSE(loopback("[::]:1"));
  EXPECT_FALSE(loopback("128.0.0.1:1"));
  EXPECT_FALSE(loopback("localhost.example:1"));
}

TEST(HostPortTest, RefusesWhatIsNoAddress) {
  for (const char* text : {"",
                           "127.0.0.1",
                           ":1",
                           "host:",
                           "host:-1",
                           "host:65536",
                           "host:x",
                           "::1:5",
                           "[::1:5",
                           "a b:1"}) {
    EXPECT_THAT(ParseHostPort(text),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("write HOST:PORT")))
        << text;
  }
}

}  // namespace
}  // namespace strata
