#include "tests/integration/ros2/ros2_fixture.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/bag_writer.h"
#include "tests/support/paths.h"
#include "tests/support/patience.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// Half of a LiDAR's pace by the clock of this machine, which has other tests to run.
constexpr absl::Duration kPace = absl::Milliseconds(100);
constexpr std::int64_t kPoseEveryNs = 10'000'000;
constexpr std::int64_t kPoseOffsetNs = 3'000'000;  // no pose has the stamp of a cloud

Pose Between(const Pose& a, const Pose& b, double share) {
  return MakePose(Eigen::Quaterniond(a.rotation()).slerp(share, Eigen::Quaterniond(b.rotation())),
                  a.translation() + share * (b.translation() - a.translation()));
}

std::size_t CountIntegrated(const std::map<std::int64_t, Stored>& scans) {
  return static_cast<std::size_t>(std::count_if(
      scans.begin(), scans.end(), [](const auto& scan) { return scan.second.integrated; }));
}

}  // namespace

bool WaitFor(const std::function<bool()>& condition) {
  const absl::Time until = SteadyNow() + kPatience;
  while (!condition()) {
    if (SteadyNow() > until) return false;
    absl::SleepFor(absl::Milliseconds(200));
  }
  return true;
}

std::vector<Pose> WayOver(double step_m, std::size_t first) {
  const World world = BridgeWorld();
  std::vector<Pose> way =
      Drive(world.scene, world.robots.front().waypoints, step_m, kSensorHeightM);
  way.erase(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(first));
  return way;
}

RobotDrive DriveOver(double step_m, std::size_t first, const Pose& T_world_odom) {
  const std::vector<Pose> truth = WayOver(step_m, first);
  std::vector<Pose> odometry =
      NoisyOdometry(truth, {.translation_sigma_m = 0.01, .rotation_sigma_rad = 0.001}, /*seed=*/1);
  for (Pose& pose : odometry) pose = T_world_odom.inverse() * pose;
  return DriveThrough(truth, odometry);
}

RobotDrive DriveThrough(const std::vector<Pose>& truth,
                        const std::vector<Pose>& T_odom_lidar,
                        std::int64_t start_ns) {
  const World world = BridgeWorld();
  const Pose T_base_lidar = MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, kSensorHeightM});
  RobotDrive drive;
  drive.clouds = truth.size();
  drive.truth = truth;
  drive.odometry = T_odom_lidar;
  drive.mounting = TransformCdr({0, "base_link"}, "lidar", T_base_lidar);
  SensorOptions sensor;
  sensor.columns = 360;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const std::int64_t stamp_ns = start_ns + static_cast<std::int64_t>(i) * kCloudEveryNs;
    const PointCloud cloud = SimulateScan(world.scene, sensor, truth[i], 1000003 * (i + 1));
    std::string data;
    for (const Eigen::Vector3f& p : cloud.points) {
      const std::array<float, 4> point = {p.x(), p.y(), p.z(), p.norm()};
      data.append(reinterpret_cast<const char*>(point.data()), sizeof(point));
    }
    drive.messages.push_back({stamp_ns, true, CloudCdr({stamp_ns, "lidar"}, data)});
    for (std::int64_t at = kPoseOffsetNs - kPoseEveryNs; at < kCloudEveryNs; at += kPoseEveryNs) {
      if (at < 0 && i > 0) continue;
      const std::size_t next = std::min(i + 1, truth.size() - 1);
      const double share = static_cast<double>(at) / kCloudEveryNs;
      const Pose T_odom_base =
          Between(T_odom_lidar[i], T_odom_lidar[next], share) * T_base_lidar.inverse();
      drive.messages.push_back(
          {stamp_ns + at, false, OdometryCdr({stamp_ns + at, "odom"}, "base_link", T_odom_base)});
    }
  }
  return drive;
}

std::string BagOf(const RobotDrive& drive) {
  std::vector<BagEntry> entries = {
      {"/tf_static", "tf2_msgs/msg/TFMessage", kStartNs, drive.mounting}};
  for (const Published& message : drive.messages) {
    entries.push_back(
        message.cloud
            ? BagEntry{"/points", "sensor_msgs/msg/PointCloud2", message.stamp_ns, message.cdr}
            : BagEntry{"/odom", "nav_msgs/msg/Odometry", message.stamp_ns, message.cdr});
  }
  return McapBytes(entries);
}

Ros2Test::Ros2Test() : robot_(domain_.number()) { setenv("ROS_LOCALHOST_ONLY", "1", 1); }

void Ros2Test::Connect(const std::string& address) {
  ClientOptions options;
  options.target = address;
  auto database = strata::Connect(options);
  ASSERT_THAT(database, IsOk());
  database_ = *std::move(database);
}

void Ros2Test::StartMapping(const std::string& address,
                            const std::vector<std::string>& more,
                            const std::string& map) {
  std::vector<std::string> arguments = {
      map, "--server", address, "--spool", Path("spool"), "--trajectory", "robot"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  StartBridge(arguments);
}

void Ros2Test::StartBridge(const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {"--domain", absl::StrCat(domain_.number()), "--output", "json"};
  all.insert(all.begin(), arguments.begin(), arguments.end());
  bridge_ = std::make_unique<ChildProcess>(Ros2Program(), all);
}

nlohmann::json Ros2Test::EndBridge() {
  bridge_->Signal(SIGTERM);
  std::string text;
  for (std::string line = bridge_->ReadLine(); !line.empty(); line = bridge_->ReadLine()) {
    text += line + "\n";
  }
  EXPECT_EQ(bridge_->Wait(), 0);
  return nlohmann::json::parse(text, nullptr, false);
}

std::map<std::int64_t, Stored> Ros2Test::ScansOf(const std::string& map, bool points) {
  std::map<std::int64_t, Stored> scans;
  EXPECT_THAT(database_->scans().List(
                  {},
                  map,
                  {},
                  [&](const ScanInfo& info) {
                    Stored& stored = scans[absl::ToUnixMicros(info.header.time)];
                    stored.uploaded = info.header.T_map_scan;
                    stored.now = info.T_map_scan;
                    stored.sequence = info.header.id.sequence;
                    stored.integrated = info.state == ScanState::kIntegrated;
                    if (!points) return absl::OkStatus();
                    return database_->scans().GetPoints(
                        {}, map, info.header.id, [&](const PointCloud& piece) {
                          stored.points.points.insert(
                              stored.points.points.end(), piece.points.begin(), piece.points.end());
                          stored.points.intensity.insert(stored.points.intensity.end(),
                                                         piece.intensity.begin(),
                                                         piece.intensity.end());
                          return absl::OkStatus();
                        });
                  }),
              IsOk());
  return scans;
}

std::size_t Ros2Test::Integrated(const std::string& map) {
  return CountIntegrated(ScansOf(map, false));
}

bool Ros2Test::HasSettled(const std::string& map, std::size_t least) {
  const auto scans = ScansOf(map, false);
  if (scans.size() != settling_ || CountIntegrated(scans) < scans.size()) {
    settled_since_ = SteadyNow();
  }
  settling_ = scans.size();
  return settling_ >= least && SteadyNow() - settled_since_ > absl::Seconds(2);
}

void Ros2DriveTest::SetUp() {
  StartServer();
  address_ = server().Address();
  Connect(address_);
  for (const char* map : {"live", "filed"}) Json({"map", "create", map, "--cell-size", "0.2"});
  clouds_ = robot_.Advertise("/points", "sensor_msgs/PointCloud2", {.depth = 1000});
  odometry_ = robot_.Advertise("/odom", "nav_msgs/Odometry", {.depth = 1000});
  mounting_ =
      robot_.Advertise("/tf_static", "tf2_msgs/TFMessage", {.transient_local = true, .depth = 1});
}

void Ros2DriveTest::AwaitReaders() {
  ASSERT_TRUE(WaitFor([&] {
    return clouds_.readers() == 1 && odometry_.readers() == 1 && mounting_.readers() == 1;
  }));
}

void Ros2DriveTest::Play(const RobotDrive& drive, const std::function<void(std::size_t)>& at) {
  ASSERT_TRUE(mounting_.Write(drive.mounting));
  std::size_t sent = 0;
  for (const Published& message : drive.messages) {
    ASSERT_TRUE((message.cloud ? clouds_ : odometry_).Write(message.cdr));
    if (!message.cloud) continue;
    if (at) at(++sent);
    absl::SleepFor(kPace);
  }
}

void Ros2DriveTest::WriteBag(const RobotDrive& drive, const std::string& name) const {
  std::ofstream(Path(name), std::ios::binary) << BagOf(drive);
}

std::size_t Ros2DriveTest::ImportAsFile(const RobotDrive& drive, const std::string& every) {
  WriteBag(drive, "drive.mcap");
  Json({"scan", "import", "filed", Path("drive.mcap"), "--every", every, "--wait"});
  return ScansOf("filed", false).size();
}

}  // namespace strata::testing
