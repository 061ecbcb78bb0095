#include "client/ros2/talk.h"

#include <sstream>

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

}  // namespace
}  // namespace strata::ros2
