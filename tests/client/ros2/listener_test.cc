#include "client/ros2/listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::ros2 {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const Listener kClouds("/points", {"sensor_msgs/PointCloud2"}, 8);

TEST(ListenerTest, WhereNobodyPublishesTheDomainMayBeWrong) {
  const std::string text = kClouds.Missing({}, "--topic");
  EXPECT_THAT(text, HasSubstr("nobody publishes /points"));
  EXPECT_THAT(text, HasSubstr("ROS_DOMAIN_ID"));
}

TEST(ListenerTest, AnotherTopicOfTheTypeIsTheCure) {
  const std::string text = kClouds.Missing(
      {{"/ouster/points", "sensor_msgs/PointCloud2", false}, {"/odom", "nav_msgs/Odometry", true}},
      "--topic");
  EXPECT_THAT(text, HasSubstr("say --topic /ouster/points"));
  EXPECT_THAT(text, Not(HasSubstr("/odom")));
}

TEST(ListenerTest, ATopicOfAnotherTypeIsNamed) {
  EXPECT_THAT(kClouds.Missing({{"/points", "sensor_msgs/LaserScan", true}}, "--topic"),
              HasSubstr("/points is a topic of sensor_msgs/LaserScan"));
}

}  // namespace
}  // namespace strata::ros2
