#include "client/formats/bags/ros_messages.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/support/bag_writer.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::Layout;
using ::strata::testing::MessageWriter;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Layout kLayouts[] = {Layout::kCdr, Layout::kCdrBigEndian, Layout::kCdr2, Layout::kRos1};
constexpr std::int64_t kStampNs = 1'700'000'123'000'000'456;

MessageEncoding EncodingOf(Layout layout) {
  return layout == Layout::kRos1 ? MessageEncoding::kRos1 : MessageEncoding::kCdr;
}

Pose SomePose() {
  return MakePose(Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), Eigen::Vector3d(1.25, -2.5, 3e5));
}

void ExpectSomePose(const RosPose& pose) {
  EXPECT_EQ(pose.header.stamp_ns, kStampNs);
  EXPECT_EQ(pose.header.frame, "odom");
  EXPECT_THAT(pose.position_m, ElementsAre(1.25, -2.5, 3e5));
  for (int k = 0; k < 4; ++k) EXPECT_DOUBLE_EQ(std::abs(pose.quaternion[k]), 0.5);
}

TEST(RosMessagesTest, LinesOfALaserInEveryLayout) {
  const float nan = std::nanf("");
  for (const Layout layout : kLayouts) {
    SCOPED_TRACE(static_cast<int>(layout));
    // The laser's own bounds are 0.1 and 30 m.
    STRATA_ASSERT_OK_AND_ASSIGN(
        const RosLaserScan scan,
        ReadRosLaserScan(
            testing::LaserMessage(
                layout, kStampNs, "laser", -0.5F, 0.25F, 0.001F, {2, 0, nan, 0.05F, 31, 4}),
            EncodingOf(layout)));
    EXPECT_EQ(scan.header.stamp_ns, kStampNs);
    EXPECT_EQ(scan.header.frame, "laser");
    ASSERT_EQ(scan.line.size(), 2U);
    EXPECT_NEAR(scan.line.points[0].x(), 2 * std::cos(0.5), 1e-6);
    EXPECT_NEAR(scan.line.points[0].y(), -2 * std::sin(0.5), 1e-6);
    EXPECT_NEAR(scan.line.points[1].x(), 4 * std::cos(0.75), 1e-6);
    EXPECT_NEAR(scan.line.points[1].y(), 4 * std::sin(0.75), 1e-6);
    EXPECT_EQ(scan.line.points[1].z(), 0.0F);
    ASSERT_EQ(scan.line.time.size(), 2U);
    EXPECT_NEAR(scan.line.time[1], 0.005, 1e-8);
  }
  EXPECT_THAT(ReadRosLaserScan(testing::LaserMessage(Layout::kCdr, 0, "laser", 0, 0.1F, 20, {1, 1}),
                               MessageEncoding::kCdr),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("in steps of 0.1")));
  const std::string whole = testing::LaserMessage(Layout::kCdr, 0, "laser", 0, 1, 0, {1, 1});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(ReadRosLaserScan(whole.substr(0, size), MessageEncoding::kCdr).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(RosMessagesTest, JointsInEveryLayout) {
  for (const Layout layout : kLayouts) {
    SCOPED_TRACE(static_cast<int>(layout));
    STRATA_ASSERT_OK_AND_ASSIGN(
        const RosJointState state,
        ReadRosJointState(testing::JointMessage(layout, kStampNs, {{"pan", 0.25}, {"tilt", -1}}),
                          EncodingOf(layout)));
    EXPECT_EQ(state.header.stamp_ns, kStampNs);
    EXPECT_THAT(state.names, ElementsAre("pan", "tilt"));
    EXPECT_THAT(state.positions, ElementsAre(0.25, -1.0));
  }
  const std::string whole = testing::JointMessage(Layout::kCdr, 0, {{"pan", 0.25}});
  for (std::size_t size = 0; size + 8 < whole.size(); ++size) {
    EXPECT_EQ(ReadRosJointState(whole.substr(0, size), MessageEncoding::kCdr).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(RosMessagesTest, PosesInEveryLayout) {
  for (const Layout layout : kLayouts) {
    SCOPED_TRACE(static_cast<int>(layout));
    BagTopic topic = {"/t", "nav_msgs/Odometry", EncodingOf(layout)};
    STRATA_ASSERT_OK_AND_ASSIGN(
        const auto odometry,
        ReadRosPoses(topic,
                     testing::OdometryMessage(layout, kStampNs, "odom", "base", SomePose())));
    ASSERT_EQ(odometry.size(), 1U);
    ExpectSomePose(odometry[0]);
    EXPECT_EQ(odometry[0].child_frame, "base");
    topic.type = "geometry_msgs/PoseStamped";
    STRATA_ASSERT_OK_AND_ASSIGN(
        const auto stamped,
        ReadRosPoses(topic, testing::PoseMessage(layout, kStampNs, "/odom", SomePose())));
    ExpectSomePose(stamped.at(0));
    EXPECT_EQ(stamped[0].child_frame, "");
    topic.type = "tf2_msgs/TFMessage";
    MessageWriter writer(layout);
    writer.Put(std::uint32_t{2});
    writer.Header(kStampNs, "odom").Text("base").Place(SomePose());
    writer.Header(kStampNs, "odom").Text("a longer name").Place(SomePose());
    STRATA_ASSERT_OK_AND_ASSIGN(const auto transforms, ReadRosPoses(topic, writer.bytes()));
    ASSERT_EQ(transforms.size(), 2U);
    ExpectSomePose(transforms[0]);
    ExpectSomePose(transforms[1]);
    EXPECT_EQ(transforms[1].child_frame, "a longer name");
  }
}

TEST(RosMessagesTest, CloudsInEveryLayout) {
  const std::vector<Eigen::Vector4f> points = {
      {1, 2, 3, 10}, {4, 5, 6, 20}, {7, 8, 9, 30}, {-1, -2, -3, 40}};
  for (const Layout layout : kLayouts) {
    SCOPED_TRACE(static_cast<int>(layout));
    const std::string message = testing::CloudMessage(layout, kStampNs, "lidar", points);
    STRATA_ASSERT_OK_AND_ASSIGN(const RosCloudHead head,
                                ReadRosCloudHead(message, EncodingOf(layout)));
    EXPECT_EQ(head.header.stamp_ns, kStampNs);
    EXPECT_EQ(head.header.frame, "lidar");
    EXPECT_EQ(head.points, 4U);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadRosCloud(message, EncodingOf(layout)));
    ASSERT_EQ(cloud.size(), 4U);
    EXPECT_EQ(cloud.points[3], Eigen::Vector3f(-1, -2, -3));
    EXPECT_THAT(cloud.intensity, ElementsAre(10, 20, 30, 40));
    EXPECT_FALSE(cloud.organised());
    STRATA_ASSERT_OK_AND_ASSIGN(
        const PointCloud grid,
        ReadRosCloud(testing::CloudMessage(layout, kStampNs, "lidar", points, 2),
                     EncodingOf(layout)));
    EXPECT_EQ(grid.rows, 2U);
    EXPECT_EQ(grid.columns, 2U);
  }
}

// A cloud of one field type for x, y, z; rows end with `padding` bytes.
std::string OddCloud(std::uint8_t type,
                     std::uint32_t size,
                     std::uint32_t rows,
                     std::uint32_t columns,
                     std::uint32_t padding,
                     bool big_endian_points,
                     const std::string& data) {
  MessageWriter writer(Layout::kCdr);
  writer.Header(kStampNs, "lidar").Put(rows).Put(columns).Put(std::uint32_t{4});
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    writer.Text(name).Put(offset).Put(type).Put(std::uint32_t{1});
    offset += size;
  }
  writer.Text("time").Put(std::uint32_t{0}).Put(type).Put(std::uint32_t{1});
  writer.Put(std::uint8_t{big_endian_points}).Put(3 * size).Put(3 * size * columns + padding);
  writer.Bytes(data).Put(std::uint8_t{1});
  return writer.bytes();
}

TEST(RosMessagesTest, RowsWithPaddingAndOtherOrdersOfBytes) {
  // Two rows of one point of int16, big-endian, with two bytes behind each.
  const std::string data("\0\1\0\2\0\3--\0\4\0\5\xFF\xFA--", 16);
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadRosCloud(OddCloud(3, 2, 2, 1, 2, true, data), MessageEncoding::kCdr));
  EXPECT_EQ(cloud.points.at(0), Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points.at(1), Eigen::Vector3f(4, 5, -6));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const RosCloudHead head,
      ReadRosCloudHead(OddCloud(3, 2, 2, 1, 2, true, data), MessageEncoding::kCdr));
  EXPECT_TRUE(head.has_point_times);
}

TEST(RosMessagesTest, SizesThatDoNotFitAreRefused) {
  const std::string data(24, '\1');
  for (const std::string& message :
       {OddCloud(7, 4, 1, 3, 0, false, data),           // more points than bytes
        OddCloud(7, 4, 0xFFFFFFFF, 1, 0, false, data),  // as many rows as there are numbers
        OddCloud(7, 4, 0xFFFFFFFF, 0xFFFFFFFF, 0, false, data),
        OddCloud(7, 4, 3, 1, 4, false, data),   // rows with padding
        OddCloud(9, 4, 1, 2, 0, false, data),   // a type that there is not
        OddCloud(8, 4, 1, 2, 0, false, data),   // a field that ends behind its point
        OddCloud(7, 0, 1, 2, 0, false, data),   // points of no byte
        OddCloud(7, 4, 0, 0, 0, false, "")}) {  // no point
    const auto cloud = ReadRosCloud(message, MessageEncoding::kCdr);
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument) << cloud.status();
  }
}

TEST(RosMessagesTest, OtherEncodingsAreRefused) {
  std::string message = testing::CloudMessage(Layout::kCdr, kStampNs, "lidar", {{1, 2, 3, 4}});
  EXPECT_THAT(ReadRosCloud(message, MessageEncoding::kUnknown),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("neither CDR")));
  message[1] = 3;  // parameter lists
  EXPECT_THAT(ReadRosCloud(message, MessageEncoding::kCdr),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("CDR of kind 3")));
}

TEST(RosMessagesTest, DamagedMessagesAreRefusedOrValid) {
  const std::vector<Eigen::Vector4f> points(9, Eigen::Vector4f(1, 2, 3, 4));
  for (const Layout layout : kLayouts) {
    const MessageEncoding encoding = EncodingOf(layout);
    testing::ExpectSoundOnDamage(
        testing::CloudMessage(layout, kStampNs, "lidar", points, 3),
        [encoding](absl::string_view bytes) { return ReadRosCloud(bytes, encoding); },
        7);
  }
  const std::string transforms =
      testing::TransformMessage(Layout::kCdr, kStampNs, "odom", "base", SomePose());
  for (std::size_t size = 0; size < transforms.size(); ++size) {
    const auto read = ReadRosPoses({"/tf", "tf2_msgs/TFMessage", MessageEncoding::kCdr},
                                   absl::string_view(transforms).substr(0, size));
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << size;
  }
}

}  // namespace
}  // namespace strata
