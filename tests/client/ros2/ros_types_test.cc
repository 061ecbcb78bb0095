#include "client/ros2/ros_types.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::ros2 {
namespace {

using testing::IsOk;

// As rmw_cyclonedds and rmw_fastrtps have them; see docs/ros2.md.
TEST(RosTypesTest, NamesAreThoseOfRos2OnTheWire) {
  EXPECT_EQ(DdsTopicName("/ouster/points"), "rt/ouster/points");
  EXPECT_EQ(DdsTypeName("sensor_msgs/PointCloud2"), "sensor_msgs::msg::dds_::PointCloud2_");
}

TEST(RosTypesTest, NamesComeBack) {
  EXPECT_EQ(RosTopicName("rt/ouster/points"), "/ouster/points");
  EXPECT_EQ(RosTypeName("tf2_msgs::msg::dds_::TFMessage_"), "tf2_msgs/TFMessage");
}

TEST(RosTypesTest, ServicesAndOthersAreNoTopics) {
  EXPECT_EQ(RosTopicName("rq/plan/get_parametersRequest"), "");
  EXPECT_EQ(RosTopicName("rt"), "");
  EXPECT_EQ(RosTopicName("DCPSParticipant"), "");
  EXPECT_EQ(RosTypeName("Square"), "");
  EXPECT_EQ(RosTypeName("a::srv::dds_::B_"), "");
}

TEST(RosTypesTest, WhatNoTopicCanBeCalledIsRefused) {
  for (const char* name : {"/points", "/_a/b_1", "/robot/lidar_top/points"}) {
    EXPECT_THAT(ValidateTopicName(name), IsOk()) << name;
  }
  for (const char* name : {"", "points", "/", "/a//b", "/a/", "/1a", "/a b", "/ä"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ValidateTopicName(name))) << name;
  }
  EXPECT_TRUE(absl::IsInvalidArgument(ValidateTopicName("/" + std::string(255, 'a'))));
}

// What idlc made of ros_messages.idl calls its types what nodes of ROS 2 call them.
TEST(RosTypesTest, DescriptorsHaveTheNamesOfTheirTypes) {
  for (const char* type : {"sensor_msgs/PointCloud2",
                           "tf2_msgs/TFMessage",
                           "nav_msgs/Odometry",
                           "nav_msgs/OccupancyGrid",
                           "nav_msgs/Path",
                           "diagnostic_msgs/DiagnosticArray",
                           "geometry_msgs/PoseStamped",
                           "geometry_msgs/PoseWithCovarianceStamped"}) {
    const dds_topic_descriptor_t* const descriptor = DescriptorOf(type);
    ASSERT_NE(descriptor, nullptr) << type;
    EXPECT_EQ(descriptor->m_typename, DdsTypeName(type));
    EXPECT_EQ(descriptor->m_nkeys, 0U);
  }
  EXPECT_EQ(DescriptorOf("std_msgs/String"), nullptr);
}

}  // namespace
}  // namespace strata::ros2
