#include "client/ros2/keeper.h"

#include <fstream>
#include <sstream>
#include <string>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/steady_time.h"
#include "tests/client/ros2/robot_messages.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::ros2 {
namespace {

using testing::IsOk;
using testing::TempDir;

Keyframe KeyframeOf(CdrMessage message, PoseBook& book) {
  Keyframe keyframe;
  keyframe.head = *ReadRosCloudHead(message.bytes, MessageEncoding::kCdr);
  keyframe.message = std::move(message);
  keyframe.pose = *book.At(keyframe.head.header.frame, keyframe.head.header.stamp_ns);
  return keyframe;
}

class KeeperTest : public ::testing::Test {
 protected:
  KeeperTest() {
    for (int i = 0; i <= 20; ++i) {
      EXPECT_THAT(book_.AddPose(PoseAt(0.1 * i, "odom", "lidar", {0.1 * i, 0, 0})), IsOk());
    }
  }

  const KeeperOptions options_ = {.map = "campus", .trajectory = "robot"};
  PoseBook book_{{}};
};

TEST_F(KeeperTest, AScanIsNumberedByItsStamp) {
  KeeperCounts counts;
  const auto scan = ScanOfKeyframe(KeyframeOf(CloudAt(1.25), book_), options_, book_, counts);
  ASSERT_THAT(scan, IsOk());
  EXPECT_EQ(scan->header.id.ToString(), "robot/1790000001250000");
  EXPECT_EQ(scan->header.time, absl::FromUnixMicros(1790000001250000));
  EXPECT_EQ(scan->header.point_count, 3U);
  EXPECT_TRUE(scan->header.has_intensity);
  EXPECT_NEAR(scan->header.T_map_scan.translation().x(), 1.25, 1e-9);
  EXPECT_THAT(scan->cloud.intensity, ::testing::ElementsAre(5, 6, 7));
}

// Points with times are where they were at the stamp: the robot drives 1 m/s along x.
TEST_F(KeeperTest, MotionIsTakenOutOfPointsWithTimes) {
  const std::vector<Eigen::Vector4f> points = {{1, 0, 0, 0}, {1, 0, 0, 0}};
  const std::string bytes = testing::CloudMessage(
      testing::Layout::kCdr, kBegin + kSecond, "lidar", points, 1, {0, 100'000'000});
  KeeperCounts counts;
  const auto scan = ScanOfKeyframe(KeyframeOf(MessageOf(bytes), book_), options_, book_, counts);
  ASSERT_THAT(scan, IsOk());
  EXPECT_EQ(counts.deskewed, 1U);
  EXPECT_NEAR(scan->cloud.points[0].x(), 1.0, 1e-5);
  EXPECT_NEAR(scan->cloud.points[1].x(), 1.1, 1e-5);
  EXPECT_TRUE(scan->cloud.time.empty());
}

TEST_F(KeeperTest, WhatIsPutIsOnDiskAtTheEnd) {
  const TempDir directory;
  const auto spool = Spool::Open(directory.path() / "spool");
  ASSERT_THAT(spool, IsOk());
  std::ostringstream said;
  Talk talk(said);
  {
    Keeper keeper(options_, book_, **spool, talk);
    EXPECT_EQ(keeper.room(), Keeper::kMostWaitingBytes);
    keeper.Put(KeyframeOf(CloudAt(1.0), book_));
    keeper.Put(KeyframeOf(CloudAt(1.5), book_));
  }
  EXPECT_EQ((*spool)->status().waiting, 2U);
  EXPECT_EQ(said.str(), "");
}

// Nothing that was chosen is given up while there may be room again.
TEST_F(KeeperTest, AFullSpoolIsSaidAndWaitedFor) {
  const TempDir directory;
  const auto spool = Spool::Open(directory.path() / "spool", {.max_bytes = 10});
  ASSERT_THAT(spool, IsOk());
  std::ostringstream said;
  Talk talk(said);
  {
    Keeper keeper(options_, book_, **spool, talk);
    keeper.Put(KeyframeOf(CloudAt(1.0), book_));
    const absl::Time until = SteadyNow() + testing::kPatience;
    while (keeper.room() == Keeper::kMostWaitingBytes && SteadyNow() < until) {
      absl::SleepFor(absl::Milliseconds(1));
    }
    absl::SleepFor(absl::Milliseconds(20));
    EXPECT_LT(keeper.room(), Keeper::kMostWaitingBytes);
    EXPECT_EQ(keeper.counts().kept, 0U);
  }
  EXPECT_THAT(said.str(), ::testing::HasSubstr("waits for room on disk"));
}

}  // namespace
}  // namespace strata::ros2
