// A robot of ROS 2, played by Fast DDS, beside a real strata-ros2 and a real stratad.
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
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
#include "tests/integration/cli_fixture.h"
#include "tests/support/bag_writer.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::int64_t kStartNs = 1'790'000'000'000'000'000;
constexpr std::int64_t kCloudEveryNs = 50'000'000;
// Half of a LiDAR's pace by the clock of this machine, which has other tests to run.
constexpr absl::Duration kPace = absl::Milliseconds(100);
constexpr std::int64_t kPoseEveryNs = 10'000'000;
constexpr std::int64_t kPoseOffsetNs = 3'000'000;  // no pose has the stamp of a cloud
constexpr double kSensorHeightM = 1.2;

bool WaitFor(const std::function<bool()>& condition) {
  const absl::Time until = SteadyNow() + absl::Seconds(90);
  while (!condition()) {
    if (SteadyNow() > until) return false;
    absl::SleepFor(absl::Milliseconds(200));
  }
  return true;
}

Pose Between(const Pose& a, const Pose& b, double share) {
  return MakePose(Eigen::Quaterniond(a.rotation()).slerp(share, Eigen::Quaterniond(b.rotation())),
                  a.translation() + share * (b.translation() - a.translation()));
}

// What the robot publishes, in order.
struct Published {
  std::int64_t stamp_ns = 0;
  bool cloud = false;
  std::string cdr;
};

struct RobotDrive {
  std::vector<Published> messages;
  std::size_t clouds = 0;
  std::vector<Pose> truth;  // T_world_lidar of each
  std::string mounting;     // base_link -> lidar, on /tf_static
};

// Over the bridge, with odometry of a wheeled robot's noise, from its `first` metre on. The
// odometry begins at T_world_odom.
RobotDrive DriveOver(double step_m,
                     std::size_t first = 0,
                     const Pose& T_world_odom = Pose::Identity()) {
  const World world = BridgeWorld();
  std::vector<Pose> truth =
      Drive(world.scene, world.robots.front().waypoints, step_m, kSensorHeightM);
  truth.erase(truth.begin(), truth.begin() + static_cast<std::ptrdiff_t>(first));
  const std::vector<Pose> odometry =
      NoisyOdometry(truth, {.translation_sigma_m = 0.01, .rotation_sigma_rad = 0.001}, /*seed=*/1);
  const Pose T_base_lidar = MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, kSensorHeightM});
  RobotDrive drive;
  drive.clouds = truth.size();
  drive.truth = truth;
  drive.mounting = TransformCdr({0, "base_link"}, "lidar", T_base_lidar);
  SensorOptions sensor;
  sensor.columns = 360;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const std::int64_t stamp_ns = kStartNs + static_cast<std::int64_t>(i) * kCloudEveryNs;
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
      const Pose T_odom_base = T_world_odom.inverse() *
                               Between(odometry[i], odometry[next], share) * T_base_lidar.inverse();
      drive.messages.push_back(
          {stamp_ns + at, false, OdometryCdr({stamp_ns + at, "odom"}, "base_link", T_odom_base)});
    }
  }
  return drive;
}

// The same messages as a recording.
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

// A scan as the map has it.
struct Stored {
  Pose uploaded = Pose::Identity(), now = Pose::Identity();
  std::uint64_t sequence = 0;
  bool integrated = false;
  PointCloud points;
};

class Ros2Test : public CliTest {
 protected:
  Ros2Test() : robot_(domain_.number()) { setenv("ROS_LOCALHOST_ONLY", "1", 1); }

  void Connect(const std::string& address) {
    ClientOptions options;
    options.target = address;
    auto database = strata::Connect(options);
    ASSERT_THAT(database, IsOk());
    database_ = *std::move(database);
  }

  void StartBridge(const std::string& address,
                   const std::vector<std::string>& more,
                   const std::string& map = "live") {
    std::vector<std::string> arguments = {map,
                                          "--server",
                                          address,
                                          "--spool",
                                          Path("spool"),
                                          "--domain",
                                          absl::StrCat(domain_.number()),
                                          "--trajectory",
                                          "robot",
                                          "--output",
                                          "json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    bridge_ = std::make_unique<ChildProcess>(STRATA_ROS2, arguments);
  }

  // What the bridge says of itself when it is asked to end.
  nlohmann::json EndBridge() {
    bridge_->Signal(SIGTERM);
    std::string text;
    for (std::string line = bridge_->ReadLine(); !line.empty(); line = bridge_->ReadLine()) {
      text += line + "\n";
    }
    EXPECT_EQ(bridge_->Wait(), 0);
    return nlohmann::json::parse(text, nullptr, false);
  }

  std::map<std::int64_t, Stored> ScansOf(const std::string& map, bool points) {
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
                            stored.points.points.insert(stored.points.points.end(),
                                                        piece.points.begin(),
                                                        piece.points.end());
                            stored.points.intensity.insert(stored.points.intensity.end(),
                                                           piece.intensity.begin(),
                                                           piece.intensity.end());
                            return absl::OkStatus();
                          });
                    }),
                IsOk());
    return scans;
  }

  bool AllIntegrated(const std::string& map, std::size_t count) {
    const auto scans = ScansOf(map, false);
    std::size_t integrated = 0;
    for (const auto& [time, scan] : scans) integrated += scan.integrated ? 1 : 0;
    return integrated == count;
  }

  // Whether so many scans, all there are, are in the map, and none has come for two seconds.
  bool HasSettled(const std::string& map, std::size_t least) {
    const auto scans = ScansOf(map, false);
    std::size_t integrated = 0;
    for (const auto& [time, scan] : scans) integrated += scan.integrated ? 1 : 0;
    if (scans.size() != settling_ || integrated < scans.size()) settled_since_ = SteadyNow();
    settling_ = scans.size();
    return settling_ >= least && SteadyNow() - settled_since_ > absl::Seconds(2);
  }

  TestDomain domain_;
  std::size_t settling_ = 0;
  absl::Time settled_since_ = SteadyNow();
  FastNode robot_;
  std::unique_ptr<ChildProcess> bridge_;
  std::unique_ptr<api::Database> database_;
};

// Hears the last message of a topic.
class Ear {
 public:
  Ear(FastNode& node, const std::string& topic, const std::string& type, const FastQos& qos) {
    reader_ = node.Subscribe(topic, type, qos, [state = state_](const std::string& cdr) {
      const std::lock_guard lock(state->mutex);
      state->last = cdr;
      ++state->count;
    });
  }
  int writers() const { return reader_.writers(); }
  int count() const {
    const std::lock_guard lock(state_->mutex);
    return state_->count;
  }
  std::string last() const {
    const std::lock_guard lock(state_->mutex);
    return state_->last;
  }

 private:
  struct State {
    std::mutex mutex;
    std::string last;
    int count = 0;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
  FastNode::Reader reader_;
};

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

// Plays drives and looks at what comes of them.
class Ros2DriveTest : public Ros2Test {
 protected:
  void SetUp() override {
    StartServer();
    address_ = server().Address();
    Connect(address_);
    for (const char* map : {"live", "filed"}) Json({"map", "create", map, "--cell-size", "0.2"});
    clouds_ = robot_.Advertise("/points", "sensor_msgs/PointCloud2", {.depth = 1000});
    odometry_ = robot_.Advertise("/odom", "nav_msgs/Odometry", {.depth = 1000});
    mounting_ =
        robot_.Advertise("/tf_static", "tf2_msgs/TFMessage", {.transient_local = true, .depth = 1});
  }

  void AwaitReaders() {
    ASSERT_TRUE(WaitFor([&] {
      return clouds_.readers() == 1 && odometry_.readers() == 1 && mounting_.readers() == 1;
    }));
  }

  // `at` is told how many clouds have been sent.
  void Play(const RobotDrive& drive, const std::function<void(std::size_t)>& at = nullptr) {
    ASSERT_TRUE(mounting_.Write(drive.mounting));
    std::size_t sent = 0;
    for (const Published& message : drive.messages) {
      ASSERT_TRUE((message.cloud ? clouds_ : odometry_).Write(message.cdr));
      if (!message.cloud) continue;
      if (at) at(++sent);
      absl::SleepFor(kPace);
    }
  }

  // The number of its keyframes.
  std::size_t ImportAsFile(const RobotDrive& drive, const std::string& every) {
    std::ofstream(Path("drive.mcap"), std::ios::binary) << BagOf(drive);
    Json({"scan", "import", "filed", Path("drive.mcap"), "--every", every, "--wait"});
    return ScansOf("filed", false).size();
  }

  // A wall across the deck, `z_m` high, in "live".
  void ParkOnTheDeck(double z_m) {
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
    const auto upload = database_->scans().Upload({}, "live", header);
    ASSERT_THAT(upload, IsOk());
    ASSERT_THAT((*upload)->Write(wall), IsOk());
    ASSERT_THAT((*upload)->Finish(), IsOk());
  }

  std::string address_;
  FastNode::Writer clouds_, odometry_, mounting_;
};

TEST_F(Ros2DriveTest, WhatARobotPublishesIsInTheMapAsItsRecordingWouldBe) {
  const RobotDrive drive = DriveOver(1.0);
  const std::size_t keyframes = ImportAsFile(drive, "1.9m");
  ASSERT_GT(keyframes, 20U);
  StartBridge(address_, {"--every", "1.9m"});
  const Ear transforms(robot_, "/tf", "tf2_msgs/TFMessage", {.depth = 100});
  AwaitReaders();
  Play(drive, [&](std::size_t sent) {
    if (sent == drive.clouds / 3) server().Signal(SIGKILL);
    if (sent == 2 * drive.clouds / 3) StartServer();
  });
  ASSERT_TRUE(WaitFor([&] { return AllIntegrated("live", keyframes); }));
  const auto live = ScansOf("live", true);
  ExpectSameScans(live, ScansOf("filed", true));

  // Where the map has the newest scan says where the odometry is.
  const Stored& newest = live.rbegin()->second;
  const Pose T_map_odom = newest.now * newest.uploaded.inverse();
  EXPECT_TRUE(WaitFor([&] {
    const std::vector<CdrTransform> heard =
        transforms.count() == 0 ? std::vector<CdrTransform>() : ReadTransforms(transforms.last());
    return heard.size() == 1 && heard[0].header.frame == "map" && heard[0].child == "odom" &&
           heard[0].pose.isApprox(T_map_odom, 1e-6);
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
  StartBridge(address_, {"--every", "0.9m"});
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
  ParkOnTheDeck(highest);
  EXPECT_TRUE(WaitFor([&] { return HeightAtX0(ReadPath(plans.last())) < 2.0; }));
  EndBridge();
}

// Whoever is in the domain may publish anything.
TEST_F(Ros2DriveTest, BytesThatAreNoMessagesChangeNothing) {
  const RobotDrive drive = DriveOver(6.0);
  StartBridge(address_, {"--every", "0m"});
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
  EXPECT_TRUE(WaitFor([&] { return AllIntegrated("live", drive.clouds); }));
  EXPECT_EQ(EndBridge()["kept"], drive.clouds);
}

// The robot drives where no server is, and is switched off before there is one again.
TEST_F(Ros2DriveTest, WhatWasKeptWithoutAServerIsSentWhenThereIsOne) {
  const RobotDrive drive = DriveOver(6.0);
  server().Signal(SIGKILL);
  StartBridge(address_, {"--every", "0m"});
  AwaitReaders();
  Play(drive);
  absl::SleepFor(absl::Seconds(1));
  const nlohmann::json away = EndBridge();
  EXPECT_EQ(away["kept"], drive.clouds);
  EXPECT_EQ(away["waiting"], drive.clouds);
  StartServer();
  StartBridge(address_, {"--every", "0m"});
  EXPECT_TRUE(WaitFor([&] { return AllIntegrated("live", drive.clouds); }));
  EXPECT_EQ(EndBridge()["sent"], drive.clouds);
}

// Its odometry begins where it was switched on, 30 m from the map's origin.
TEST_F(Ros2DriveTest, ARobotThatDoesNotKnowWhereItIsAsksTheServer) {
  ImportAsFile(DriveOver(1.0), "0.9m");
  const Pose T_map_odom = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {-11.0, 2.0, 3.0});
  const RobotDrive drive = DriveOver(1.0, 20, T_map_odom);
  StartBridge(address_, {"--every", "0.9m", "--localize"}, "filed");
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
