#include "client/ros2/pose_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/ros2/robot_messages.h"
#include "tests/support/status_matchers.h"

namespace strata::ros2 {
namespace {

using testing::IsOk;

constexpr std::int64_t kHalf = kSecond / 2;

TEST(PoseBookTest, ACloudsPoseIsBetweenThoseOfTheOdometry) {
  PoseBook book({});
  ASSERT_THAT(book.AddTransforms({PoseAt(0, "base_link", "lidar", {0.1, 0, 1.2})}, true), IsOk());
  ASSERT_THAT(book.AddPose(PoseAt(0, "odom", "base_link", {1, 0, 0})), IsOk());
  EXPECT_FALSE(book.At("lidar", kBegin + kHalf).ok());  // may come yet
  ASSERT_THAT(book.AddPose(PoseAt(1, "odom", "base_link", {3, 0, 0})), IsOk());
  const auto pose = book.At("lidar", kBegin + kHalf);
  ASSERT_THAT(pose, IsOk());
  EXPECT_TRUE(pose->T_map_scan.translation().isApprox(Eigen::Vector3d(2.1, 0, 1.2)));
  EXPECT_EQ(book.frames().fixed, "odom");
  EXPECT_EQ(book.newest()->stamp_ns, kBegin + kSecond);
}

TEST(PoseBookTest, WithoutTheSensorsPlaceTheCureIsSaid) {
  PoseBook book({});
  ASSERT_THAT(book.AddPose(PoseAt(0, "odom", "base_link", {1, 0, 0})), IsOk());
  const auto pose = book.At("lidar", kBegin);
  ASSERT_TRUE(absl::IsNotFound(pose.status()));
  EXPECT_THAT(std::string(pose.status().message()), ::testing::HasSubstr("--mount"));
}

TEST(PoseBookTest, AMountGoesBeforeTheTransforms) {
  PoseBook book({.T_base_cloud = MakePose(Eigen::Quaterniond::Identity(), {0, 0, 2})});
  ASSERT_THAT(book.AddPose(PoseAt(0, "odom", "base_link", {1, 0, 0})), IsOk());
  EXPECT_TRUE(
      book.At("lidar", kBegin)->T_map_scan.translation().isApprox(Eigen::Vector3d(1, 0, 2)));
}

// Each frame of a chain comes with stamps of its own.
TEST(PoseBookTest, TransformsOfAChainMeetBetweenTheirStamps) {
  PoseBook book({.transforms = PoseFrames{"odom", "base_link"}});
  for (int i = 0; i < 10; ++i) {
    ASSERT_THAT(book.AddTransforms({PoseAt(0.1 * i, "odom", "foot", {0.1 * i, 0, 0})}, false),
                IsOk());
    ASSERT_THAT(
        book.AddTransforms({PoseAt(0.1 * i + 0.05, "foot", "base_link", {0, 0, 0.5})}, false),
        IsOk());
  }
  ASSERT_TRUE(book.newest().has_value());
  EXPECT_EQ(book.newest()->stamp_ns, kBegin + static_cast<std::int64_t>(0.9 * 1e9));
  EXPECT_TRUE(
      book.newest()->T_fixed_base.translation().isApprox(Eigen::Vector3d(0.9, 0, 0.5), 1e-9));
}

TEST(PoseBookTest, AStartMovesWhatIsUploadedAndNotTheOdometry) {
  PoseBook book({});
  ASSERT_THAT(book.AddPose(PoseAt(0, "odom", "base_link", {1, 0, 0})), IsOk());
  book.SetStart(MakePose(Eigen::Quaterniond::Identity(), {0, 10, 0}));
  EXPECT_TRUE(
      book.At("base_link", kBegin)->T_map_scan.translation().isApprox(Eigen::Vector3d(1, 10, 0)));
  EXPECT_TRUE(book.newest()->T_fixed_base.translation().isApprox(Eigen::Vector3d(1, 0, 0)));
}

TEST(PoseBookTest, HoursOfPosesAreForgottenAndTheSensorsPlaceIsNot) {
  PoseBook book({});
  ASSERT_THAT(book.AddTransforms({PoseAt(0, "base_link", "lidar", {0, 0, 1})}, true), IsOk());
  constexpr int kPoses = 500'000;  // more than a book holds
  for (int i = 0; i < kPoses; ++i) {
    ASSERT_THAT(book.AddPose(PoseAt(0.02 * i, "odom", "base_link", {0.01 * i, 0, 0})), IsOk());
  }
  const std::int64_t last_ns = book.newest()->stamp_ns;
  EXPECT_THAT(book.At("lidar", last_ns - 30 * kSecond), IsOk());
  EXPECT_FALSE(book.At("lidar", last_ns - 3600 * kSecond).ok());
}

// Somebody whose clock stands still, or worse.
TEST(PoseBookTest, ABookHoldsSoMuchAndNoMore) {
  PoseBook book({});
  int taken = 0;
  for (int i = 0; i < 200'000; ++i) {
    taken += book.AddPose(PoseAt(0, "odom", "base_link", {1, 0, 0})).ok() ? 1 : 0;
  }
  EXPECT_EQ(taken, 100'000);
}

TEST(PoseBookTest, APoseThatIsNoneIsRefused) {
  PoseBook book({});
  RosPose pose = PoseAt(0, "odom", "base_link", {1, 0, 0});
  pose.quaternion = {0, 0, 0, 0};
  EXPECT_TRUE(absl::IsInvalidArgument(book.AddPose(pose)));
}

}  // namespace
}  // namespace strata::ros2
