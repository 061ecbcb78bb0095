#include "client/ros2/talk.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace strata::ros2 {
namespace {

TEST(TalkTest, HowSomethingStandsIsSaidOnceUntilItIsOtherwise) {
  std::ostringstream said;
  Talk talk(said);
  for (int i = 0; i < 3; ++i) talk.SayNew("server", "away");
  talk.SayNew("disk", "full");
  talk.SayNew("server", "");
  talk.SayNew("server", "away");
  EXPECT_EQ(said.str(), "away\nfull\naway\n");
}

TEST(TalkTest, WhatIsOtherwiseEveryTimeIsSaidSeldom) {
  std::ostringstream said;
  Talk talk(said);
  for (int i = 0; i < 100; ++i) talk.SaySeldom("pose", "pose " + std::to_string(i));
  talk.SaySeldom("cloud", "cloud");
  EXPECT_EQ(said.str(), "pose 0\ncloud\n");
}

}  // namespace
}  // namespace strata::ros2
