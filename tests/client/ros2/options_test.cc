#include "client/ros2/options.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::ros2 {
namespace {

using testing::IsOk;

Options Parsed(std::vector<std::string> words) {
  CLI::App app;
  Options options;
  AddOptions(app, options);
  words.insert(words.begin(), {"campus", "--spool", "dir"});
  std::reverse(words.begin(), words.end());
  app.parse(words);
  return options;
}

TEST(Ros2OptionsTest, AMapAndASpoolAreEnough) {
  unsetenv("ROS_DOMAIN_ID");
  const Options options = Parsed({});
  EXPECT_THAT(ValidateOptions(options), IsOk());
  EXPECT_EQ(options.clouds, "/points");
  EXPECT_EQ(options.poses_from, "/odom");
  EXPECT_EQ(options.domain, 0);
}

TEST(Ros2OptionsTest, TheDomainIsThatOfTheEnvironment) {
  setenv("ROS_DOMAIN_ID", "42", 1);
  EXPECT_EQ(Parsed({}).domain, 42);
  EXPECT_EQ(Parsed({"--domain", "7"}).domain, 7);
  unsetenv("ROS_DOMAIN_ID");
}

TEST(Ros2OptionsTest, WhatWasInferredIsMindedIfAskedTo) {
  EXPECT_EQ(Parsed({}).inferred, InferredAs::kIgnore);
  EXPECT_EQ(Parsed({"--inferred", "obstacle"}).inferred, InferredAs::kObstacle);
}

TEST(Ros2OptionsTest, PosesMayBeTransforms) {
  EXPECT_THAT(ValidateOptions(Parsed({"--poses-from", "tf:odom->base_link"})), IsOk());
}

TEST(Ros2OptionsTest, WhatIsWrongIsNamed) {
  const std::vector<std::vector<std::string>> wrong = {{"--topic", "points"},
                                                       {"--every", "fast"},
                                                       {"--poses-from", "tf:odom"},
                                                       {"--poses-from", "odom"},
                                                       {"--map-topic", "/a b"}};
  for (const auto& words : wrong) {
    const absl::Status status = ValidateOptions(Parsed(words));
    EXPECT_TRUE(absl::IsInvalidArgument(status));
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(words[0]));
  }
}

TEST(Ros2OptionsTest, WhoOnlyWantsToKnowWhereItIsNeedsNoSpool) {
  const auto parsed = [](std::vector<std::string> words) {
    CLI::App app;
    Options options;
    AddOptions(app, options);
    std::reverse(words.begin(), words.end());
    app.parse(words);
    return options;
  };
  const Options options = parsed({"campus", "--localize-only"});
  EXPECT_THAT(ValidateOptions(options), IsOk());
  EXPECT_EQ(options.pose_topic, "/amcl_pose");
  EXPECT_THAT(std::string(ValidateOptions(parsed({"campus"})).message()),
              ::testing::HasSubstr("--spool"));
  // What would not be listened to is refused.
  for (const char* more : {"--every", "--trajectory", "--align", "--spool"}) {
    const std::string value = std::string(more) == "--align" ? "on" : "1m";
    EXPECT_THROW(parsed({"campus", "--localize-only", more, value}), CLI::ParseError) << more;
  }
}

TEST(Ros2OptionsTest, ARunIsCalledByItsTime) {
  EXPECT_EQ(TrajectoryAt(absl::FromUnixSeconds(1'795'713'300)), "ros2-20261126-171500");
}

}  // namespace
}  // namespace strata::ros2
