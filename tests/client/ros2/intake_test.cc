#include "client/ros2/intake.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/ros2/robot_messages.h"
#include "tests/support/status_matchers.h"

namespace strata::ros2 {
namespace {

constexpr std::size_t kRoom = 1'000'000;

class IntakeTest : public ::testing::Test {
 protected:
  // Drives along x, a metre a second, with an odometry of 10 Hz.
  void DriveUntil(double seconds) {
    for (; next_pose_ * 0.1 <= seconds; ++next_pose_) {
      ASSERT_THAT(
          book_.AddPose(PoseAt(0.1 * next_pose_, "odom", "lidar", {0.1 * next_pose_, 0, 0})),
          testing::IsOk());
    }
  }
  void Add(double seconds) { intake_.Add(CloudAt(seconds), now_); }
  std::vector<Keyframe> Decide(std::size_t room = kRoom) { return intake_.Decide(now_, room); }

  PoseBook book_{{}};
  Intake intake_{book_, {.distance_m = 0.5, .angle_rad = {}, .time_s = {}}};
  absl::Time now_ = absl::UnixEpoch();
  int next_pose_ = 0;
};

TEST_F(IntakeTest, CloudsHalfAMetreApartAreKept) {
  DriveUntil(2.0);
  std::vector<double> kept;
  for (int i = 0; i <= 40; ++i) {
    Add(0.05 * i);
    for (const Keyframe& keyframe : Decide()) {
      kept.push_back(keyframe.pose.T_map_scan.translation().x());
    }
  }
  ASSERT_EQ(kept.size(), 5U);
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_NEAR(kept[i], 0.5 * i, 1e-9);
  EXPECT_EQ(intake_.counts().clouds, 41U);
  EXPECT_EQ(intake_.counts().keyframes, 5U);
}

TEST_F(IntakeTest, ACloudWaitsForItsPose) {
  DriveUntil(0.1);
  Add(0.15);
  EXPECT_TRUE(Decide().empty());
  now_ += Intake::kPatience / 2;
  DriveUntil(0.2);
  EXPECT_EQ(Decide().size(), 1U);
}

TEST_F(IntakeTest, ACloudWhosePoseNeverComesIsLeftOutAndSaid) {
  DriveUntil(0.1);
  Add(5.0);
  now_ += Intake::kPatience;
  EXPECT_TRUE(Decide().empty());
  EXPECT_EQ(intake_.counts().without_pose, 1U);
  EXPECT_THAT(intake_.counts().why, ::testing::HasSubstr("outside"));
  DriveUntil(6.0);
  Add(6.0);
  EXPECT_EQ(Decide().size(), 1U);  // and keeps nothing back
}

// A disk that is too slow makes keyframes rarer; none that was chosen is lost.
TEST_F(IntakeTest, WhereThereIsNoRoomALaterCloudIsKept) {
  DriveUntil(3.0);
  Add(0.0);
  EXPECT_EQ(Decide().size(), 1U);
  for (const double seconds : {0.5, 1.0}) {
    Add(seconds);
    EXPECT_TRUE(Decide(0).empty());
  }
  Add(1.1);
  const std::vector<Keyframe> kept = Decide();
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_NEAR(kept[0].pose.T_map_scan.translation().x(), 1.1, 1e-9);
  EXPECT_EQ(intake_.counts().keyframes, 2U);
  EXPECT_EQ(intake_.counts().postponed, 2U);
}

TEST_F(IntakeTest, WhatWaitsIsBounded) {
  constexpr std::size_t kPoints = 100'000;
  const std::string cloud = testing::CloudMessage(
      testing::Layout::kCdr, kBegin, "lidar", std::vector<Eigen::Vector4f>(kPoints, {1, 2, 3, 4}));
  constexpr std::size_t kClouds = 40;
  for (std::size_t i = 0; i < kClouds; ++i) intake_.Add(MessageOf(cloud), now_);
  const std::size_t waiting = Intake::kMostWaitingBytes / cloud.size();
  EXPECT_EQ(intake_.counts().crowded_out, kClouds - waiting);
}

TEST_F(IntakeTest, ACloudThatIsNotNewerIsLeftOut) {
  DriveUntil(2.0);
  Add(1.0);
  EXPECT_EQ(Decide().size(), 1U);
  Add(0.2);
  Add(1.0);
  EXPECT_TRUE(Decide().empty());
  EXPECT_EQ(intake_.counts().back_in_time, 2U);
}

TEST_F(IntakeTest, BytesThatAreNoCloudAreCounted) {
  intake_.Add(MessageOf(""), now_);
  intake_.Add(MessageOf(std::string(8, '\0')), now_);
  const std::string cloud(CloudAt(0.0).bytes);
  for (std::size_t length = 0; length < cloud.size(); length += 3) {
    intake_.Add(MessageOf(cloud.substr(0, length)), now_);
  }
  EXPECT_EQ(intake_.counts().unreadable, intake_.counts().clouds);
  EXPECT_TRUE(Decide().empty());
}

TEST_F(IntakeTest, AHugeCloudIsNotTaken) {
  intake_.Add(MessageOf(std::string(Intake::kMostCloudBytes + 1, '\0')), now_);
  EXPECT_EQ(intake_.counts().unreadable, 1U);
  EXPECT_THAT(intake_.counts().why, ::testing::HasSubstr("at most"));
}

}  // namespace
}  // namespace strata::ros2
