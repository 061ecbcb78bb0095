// A robot of ROS 2, played by Fast DDS, beside a real strata-ros2 and a real stratad.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/steady_time.h"
#include "core/geometry/pose.h"
#include "tests/integration/ros2/ros2_fixture.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

void ExpectSameScans(const std::map<std::int64_t, Stored>& live,
                     const std::map<std::int64_t, Stored>& filed) {
  ASSERT_EQ(live.size(), filed.size());
  for (const auto& [time, scan] : filed) {
    const auto found = live.find(time);
    ASSERT_NE(found, live.end()) << "no scan at " << time;
    EXPECT_EQ(found->second.uploaded.matrix(), scan.uploaded.matrix()) << time;
    EXPECT_EQ(found->second.points.points, scan.points.points) << time;
    EXPECT_EQ(found->second.points.intensity, scan.points.intensity) << time;
  }
}

// A picture as nav2's map_server reads it, in the order and with the values of OccupancyGrid.
std::vector<std::int8_t> ReadPgm(const std::string& path, std::uint32_t& width) {
  std::ifstream file(path, std::ios::binary);
  std::string magic;
  std::uint32_t height = 0, most = 0;
  file >> magic >> width >> height >> most;
  file.get();
  std::vector<std::int8_t> values(std::size_t{width} * height);
  for (std::uint32_t y = height; y-- > 0;) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const int value = file.get();
      values[std::size_t{y} * width + x] = static_cast<std::int8_t>(value == 254 ? 0
                                                                    : value == 0 ? 100
                                                                                 : -1);
    }
  }
  return values;
}

// Where a path crosses the plane x = 0; 0 where it does not.
double HeightAtX0(const CdrPath& path) {
  for (std::size_t i = 1; i < path.poses.size(); ++i) {
    const Eigen::Vector3d a = path.poses[i - 1].translation();
    const Eigen::Vector3d b = path.poses[i].translation();
    if (a.x() * b.x() <= 0.0) return a.z() + (b.z() - a.z()) * a.x() / (a.x() - b.x());
  }
  return 0.0;
}

// A wall across the deck, `z_m` high, in "live".
void ParkOnTheDeck(api::Database& database, double z_m) {
  ScanHeader header;
  header.id = {"somebody", 1};
  header.alignment = Alignment::kOff;
  PointCloud wall;
  for (double x = -0.3; x <= 0.3; x += 0.05) {
    for (double y = -2.5; y <= 2.5; y += 0.05) {
      for (double z = z_m + 0.1; z <= z_m + 1.5; z += 0.1) {
        wall.points.emplace_back(
            static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
      }
    }
  }
  AnnouncePoints(wall, header);
  const auto upload = database.scans().Upload({}, "live", header);
  ASSERT_THAT(upload, IsOk());
  ASSERT_THAT((*upload)->Write(wall), IsOk());
  ASSERT_THAT((*upload)->Finish(), IsOk());
}

TEST_F(Ros2DriveTest, WhatARobotPublishesIsInTheMapAsItsRecordingWouldBe) {
  const RobotDrive drive = DriveOver(1.0);
  const std::size_t keyframes = ImportAsFile(drive, "1.9m");
  ASSERT_GT(keyframes, 20U);
  StartMapping(address_, {"--every", "1.9m"});
  const Ear transforms(robot_, "/tf", "tf2_msgs/TFMessage", {.depth = 100});
  AwaitReaders();
  Play(drive, [&](std::size_t sent) {
    if (sent == drive.clouds / 3) server().Signal(SIGKILL);
    if (sent == 2 * drive.clouds / 3) StartServer();
  });
  ASSERT_TRUE(WaitFor([&] { return Integrated("live") == keyframes; }));
  const auto live = ScansOf("live", true);
  ExpectSameScans(live, ScansOf("filed", true));

  // map -> odom takes the newest scan's odometry to where the map has it.
  const std::int64_t stamp_ns = 1000 * live.rbegin()->first;
  const Stored& newest = live.rbegin()->second;
  const auto cloud = static_cast<std::size_t>((stamp_ns - kStartNs) / kCloudEveryNs);
  EXPECT_TRUE(WaitFor([&] {
    const std::vector<CdrTransform> heard =
        transforms.count() == 0 ? std::vector<CdrTransform>() : ReadTransforms(transforms.last());
    return heard.size() == 1 && heard[0].header.frame == "map" && heard[0].child == "odom" &&
           (heard[0].pose * drive.odometry[cloud]).isApprox(newest.now, 0.003);
  }));

  const nlohmann::json summary = EndBridge();
  EXPECT_EQ(summary["clouds"], drive.clouds);
  EXPECT_EQ(summary["kept"], keyframes);
  EXPECT_EQ(summary["sent"], keyframes);
  EXPECT_EQ(summary["waiting"], 0);
  EXPECT_EQ(summary["refused"], 0);
}

TEST_F(Ros2DriveTest, WhatTheMapKnowsComesToWhoeverJoinsLate) {
  const RobotDrive drive = DriveOver(1.0);
  const std::size_t keyframes = ImportAsFile(drive, "0.9m");
  StartMapping(address_, {"--every", "0.9m"});
  AwaitReaders();
  Play(drive);
  // A machine that is busy for long may lose one of the clouds.
  ASSERT_TRUE(WaitFor([&] { return HasSettled("live", keyframes * 9 / 10); }));

  FastNode late(domain_.number());
  const FastQos latched = {.transient_local = true, .depth = 1};
  const Ear grids(late, "/map", "nav_msgs/OccupancyGrid", latched);
  const Ear surfaces(late, "/strata/surfaces", "sensor_msgs/PointCloud2", latched);
  const Stored newest = ScansOf("live", false).rbegin()->second;
  const Eigen::Vector3d robot =
      newest.now.translation() - kSensorHeightM * Eigen::Vector3d::UnitZ();
  Json({"map",
        "export",
        "live",
        "--format",
        "nav2",
        "--at",
        absl::StrCat(robot.x(), ",", robot.y(), ",", robot.z()),
        "--out",
        Path("floor")});
  std::uint32_t width = 0;
  const std::vector<std::int8_t> expected = ReadPgm(Path("floor.pgm"), width);
  EXPECT_TRUE(WaitFor([&] {
    const CdrGrid grid = grids.count() == 0 ? CdrGrid() : ReadGrid(grids.last());
    return grid.header.frame == "map" && grid.width == width && grid.data == expected;
  }));
  EXPECT_TRUE(WaitFor([&] {
    const CdrCloud cloud = surfaces.count() == 0 ? CdrCloud() : ReadCloud(surfaces.last());
    return cloud.width > 10'000 && cloud.data.size() == cloud.width * cloud.point_step &&
           cloud.fields.size() == 6 && cloud.fields[3] == "rgb";
  }));

  // From where the robot is, in the frame of its odometry, back over the bridge.
  auto goals = late.Advertise("/goal_pose", "geometry_msgs/PoseStamped", {});
  const Ear plans(late, "/strata/plan", "nav_msgs/Path", {});
  ASSERT_TRUE(WaitFor([&] { return goals.readers() == 1 && plans.writers() == 1; }));
  const Eigen::Vector3d west = BridgeWorld().places.at("west");
  const Pose T_odom_map = newest.uploaded * newest.now.inverse();
  const std::string goal =
      PoseCdr({0, "odom"}, MakePose(Eigen::Quaterniond::Identity(), T_odom_map * west));
  // The bridge may hear of the reader a moment later, and what is not latched is not said twice.
  ASSERT_TRUE(WaitFor([&] {
    EXPECT_TRUE(goals.Write(goal));
    return plans.count() > 0;
  }));
  const CdrPath path = ReadPath(plans.last());
  ASSERT_GT(path.poses.size(), 1U);
  EXPECT_EQ(path.header.frame, "map");
  EXPECT_LT((path.poses.front().translation() - robot).norm(), 1.5);
  EXPECT_LT((path.poses.back().translation() - west).norm(), 0.5);
  double highest = 0.0;
  for (const Pose& pose : path.poses) highest = std::max(highest, pose.translation().z());
  EXPECT_GT(highest, 3.0);  // over the deck

  // Somebody parks there: it goes another way, or nowhere.
  EXPECT_GT(HeightAtX0(path), 3.0);
  ParkOnTheDeck(*database_, highest);
  EXPECT_TRUE(WaitFor([&] { return HeightAtX0(ReadPath(plans.last())) < 2.0; }));
  EndBridge();
}

// Whoever is in the domain may publish anything.
TEST_F(Ros2DriveTest, BytesThatAreNoMessagesChangeNothing) {
  const RobotDrive drive = DriveOver(6.0);
  StartMapping(address_, {"--every", "0m"});
  auto transforms = robot_.Advertise("/tf", "tf2_msgs/TFMessage", {.depth = 100});
  auto goals = robot_.Advertise("/goal_pose", "geometry_msgs/PoseStamped", {});
  AwaitReaders();
  ASSERT_TRUE(WaitFor([&] { return transforms.readers() == 1 && goals.readers() == 1; }));
  const std::string cloud = drive.messages.front().cdr;
  Random random(7);
  for (int i = 0; i < 300; ++i) {
    std::string bytes = cloud.substr(0, 4 + random.Bits() % 200);
    const std::size_t changed = 4 + random.Bits() % (bytes.size() - 3);
    for (std::size_t k = changed; k < bytes.size(); ++k) {
      bytes[k] = static_cast<char>(random.Bits());
    }
    for (FastNode::Writer* writer : {&clouds_, &odometry_, &mounting_, &transforms, &goals}) {
      EXPECT_TRUE(writer->Write(bytes));
    }
  }
  Play(drive);
  EXPECT_TRUE(WaitFor([&] { return Integrated("live") == drive.clouds; }));
  EXPECT_EQ(EndBridge()["kept"], drive.clouds);
}

// The robot drives where no server is, and is switched off before there is one again.
TEST_F(Ros2DriveTest, WhatWasKeptWithoutAServerIsSentWhenThereIsOne) {
  const RobotDrive drive = DriveOver(6.0);
  server().Signal(SIGKILL);
  StartMapping(address_, {"--every", "0m"});
  AwaitReaders();
  Play(drive);
  absl::SleepFor(absl::Seconds(1));
  const nlohmann::json away = EndBridge();
  EXPECT_EQ(away["kept"], drive.clouds);
  EXPECT_EQ(away["waiting"], drive.clouds);
  StartServer();
  StartMapping(address_, {"--every", "0m"});
  EXPECT_TRUE(WaitFor([&] { return Integrated("live") == drive.clouds; }));
  EXPECT_EQ(EndBridge()["sent"], drive.clouds);
}

// Its odometry begins where it was switched on, 30 m from the map's origin.
TEST_F(Ros2DriveTest, ARobotThatDoesNotKnowWhereItIsAsksTheServer) {
  ImportAsFile(DriveOver(1.0), "0.9m");
  const Pose T_map_odom = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {-11.0, 2.0, 3.0});
  const RobotDrive drive = DriveOver(1.0, 20, T_map_odom);
  StartMapping(address_, {"--every", "0.9m", "--localize"}, "filed");
  const Ear transforms(robot_, "/tf", "tf2_msgs/TFMessage", {.depth = 100});
  AwaitReaders();
  Play(drive, [&](std::size_t sent) {
    if (sent != 3) return;
    EXPECT_TRUE(WaitFor([&] {
      return transforms.count() > 0 &&
             ReadTransforms(transforms.last()).front().pose.isApprox(T_map_odom, 0.05);
    }));
  });
  const auto robot_scans = [this] {
    std::vector<ScanInfo> scans;
    api::ScanFilter filter;
    filter.trajectory = "robot";
    EXPECT_THAT(database_->scans().List({},
                                        "filed",
                                        filter,
                                        [&scans](const ScanInfo& info) {
                                          scans.push_back(info);
                                          return absl::OkStatus();
                                        }),
                IsOk());
    return scans;
  };
  ASSERT_TRUE(WaitFor([&] { return robot_scans().size() > 3; }));
  // As uploaded, before the map has corrected anything: there.
  const RobotDrive there = DriveOver(1.0, 20);
  for (const ScanInfo& scan : robot_scans()) {
    const std::int64_t stamp_ns = absl::ToUnixNanos(scan.header.time);
    const auto cloud = static_cast<std::size_t>((stamp_ns - kStartNs) / kCloudEveryNs);
    EXPECT_LT((scan.header.T_map_scan.translation() - there.truth[cloud].translation()).norm(),
              0.5);
  }
  EndBridge();
}

}  // namespace
}  // namespace strata::testing
