// A robot of ROS 2 to try strata-ros2 on, by Fast DDS: publishes what strata-simulate has written,
// and says what it hears.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "client/formats/scan_list.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/geometry/pose.h"
#include "tests/support/patience.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/ros2/ros_cdr.h"

namespace strata::testing {
namespace {

constexpr double kHeightM = 1.2;  // of the sensor, as strata-simulate has it
constexpr int kPosesPerCloud = 5;

struct RobotOptions {
  int domain = 0;
  std::string folder;
  double hertz = 10.0;
  std::string goal;
};

absl::Status Await(const std::function<bool()>& condition, const std::string& what) {
  const absl::Time until = SteadyNow() + kPatience;
  while (!condition()) {
    if (SteadyNow() > until) return absl::DeadlineExceededError(absl::StrCat("no ", what));
    absl::SleepFor(absl::Milliseconds(20));
  }
  return absl::OkStatus();
}

std::string PointBytes(const PointCloud& cloud) {
  std::string data;
  for (const Eigen::Vector3f& p : cloud.points) {
    const std::array<float, 4> point = {p.x(), p.y(), p.z(), 0.0F};
    data.append(reinterpret_cast<const char*>(point.data()), sizeof(point));
  }
  return data;
}

Pose BetweenPoses(const Pose& a, const Pose& b, double share) {
  return MakePose(Eigen::Quaterniond(a.rotation()).slerp(share, Eigen::Quaterniond(b.rotation())),
                  a.translation() + share * (b.translation() - a.translation()));
}

absl::Status DriveAlong(const RobotOptions& options) {
  const std::filesystem::path folder = options.folder;
  ScanListOptions list;
  list.poses = folder / "poses_initial.txt";
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanFile> scans, ListScans({folder / "scans"}, list));
  FastNode node(options.domain);
  auto clouds = node.Advertise("/points", "sensor_msgs/PointCloud2", {.depth = 20});
  auto odometry = node.Advertise("/odom", "nav_msgs/Odometry", {.depth = 100});
  auto mounting =
      node.Advertise("/tf_static", "tf2_msgs/TFMessage", {.transient_local = true, .depth = 1});
  const Pose T_base_lidar = MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, kHeightM});
  mounting.Write(TransformCdr({0, "base_link"}, "lidar", T_base_lidar));
  STRATA_RETURN_IF_ERROR(Await(
      [&] { return clouds.readers() > 0 && odometry.readers() > 0 && mounting.readers() > 0; },
      "strata-ros2 listens"));
  const auto period_ns = static_cast<std::int64_t>(1e9 / options.hertz);
  const std::int64_t begin_ns = absl::ToUnixNanos(absl::Now());
  std::size_t poses = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::int64_t stamp_ns = begin_ns + static_cast<std::int64_t>(i) * period_ns;
    STRATA_ASSIGN_OR_RETURN(const PointCloud cloud, ReadScanFile(scans[i]));
    clouds.Write(CloudCdr({stamp_ns, "lidar"}, PointBytes(cloud)));
    const Pose& next = scans[std::min(i + 1, scans.size() - 1)].T_map_scan;
    for (int k = 0; k < kPosesPerCloud; ++k, ++poses) {
      const std::int64_t at_ns = stamp_ns + k * period_ns / kPosesPerCloud;
      const Pose T_odom_lidar =
          BetweenPoses(scans[i].T_map_scan, next, static_cast<double>(k) / kPosesPerCloud);
      odometry.Write(
          OdometryCdr({at_ns, "odom"}, "base_link", T_odom_lidar * T_base_lidar.inverse()));
    }
    absl::SleepFor(absl::Nanoseconds(period_ns));
  }
  absl::SleepFor(absl::Seconds(1));  // what is asked for again
  std::cout << scans.size() << " clouds on /points, " << poses << " poses on /odom" << std::endl;
  return absl::OkStatus();
}

// The last message of a topic.
class Heard {
 public:
  Heard(FastNode& node, const std::string& topic, const std::string& type, bool latched) {
    const auto keep = [this](const std::string& cdr) {
      const std::lock_guard lock(mutex_);
      last_ = cdr;
    };
    reader_ = node.Subscribe(topic, type, {.transient_local = latched}, keep);
  }
  int writers() const { return reader_.writers(); }
  std::optional<std::string> last() const {
    const std::lock_guard lock(mutex_);
    return last_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<std::string> last_;
  FastNode::Reader reader_;
};

absl::Status Hear(const RobotOptions& options) {
  FastNode node(options.domain);
  const Heard grids(node, "/map", "nav_msgs/OccupancyGrid", true);
  const Heard surfaces(node, "/strata/surfaces", "sensor_msgs/PointCloud2", true);
  const Heard transforms(node, "/tf", "tf2_msgs/TFMessage", false);
  STRATA_RETURN_IF_ERROR(Await([&] { return grids.last().has_value(); }, "/map"));
  STRATA_RETURN_IF_ERROR(Await([&] { return surfaces.last().has_value(); }, "/strata/surfaces"));
  STRATA_RETURN_IF_ERROR(Await([&] { return transforms.last().has_value(); }, "transform on /tf"));
  const CdrGrid grid = ReadGrid(*grids.last());
  std::size_t free = 0, occupied = 0;
  for (const std::int8_t value : grid.data) {
    free += value == 0 ? 1 : 0;
    occupied += value == 100 ? 1 : 0;
  }
  std::cout << absl::StrFormat("/map: frame %s, %d x %d cells of %.2f m, %d free, %d occupied\n",
                               grid.header.frame,
                               grid.width,
                               grid.height,
                               grid.resolution_m,
                               free,
                               occupied);
  const CdrCloud cloud = ReadCloud(*surfaces.last());
  std::cout << absl::StrFormat(
      "/strata/surfaces: frame %s, %d surfaces\n", cloud.header.frame, cloud.width);
  for (const CdrTransform& transform : ReadTransforms(*transforms.last())) {
    const Eigen::Vector3d p = transform.pose.translation();
    std::cout << absl::StrFormat("/tf: %s -> %s at %.2f, %.2f, %.2f\n",
                                 transform.header.frame,
                                 transform.child,
                                 p.x(),
                                 p.y(),
                                 p.z());
  }
  return absl::OkStatus();
}

absl::Status AskForPath(const RobotOptions& options) {
  const std::vector<std::string> numbers = absl::StrSplit(options.goal, ',');
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    if (numbers.size() != 3 || !absl::SimpleAtod(numbers[i], &goal[static_cast<int>(i)])) {
      return absl::InvalidArgumentError("a goal is X,Y,Z");
    }
  }
  FastNode node(options.domain);
  auto goals = node.Advertise("/goal_pose", "geometry_msgs/PoseStamped", {});
  const Heard plans(node, "/strata/plan", "nav_msgs/Path", false);
  STRATA_RETURN_IF_ERROR(
      Await([&] { return goals.readers() > 0 && plans.writers() > 0; }, "strata-ros2 listens"));
  absl::SleepFor(absl::Milliseconds(500));  // until it knows of that, too
  goals.Write(PoseCdr({0, "map"}, MakePose(Eigen::Quaterniond::Identity(), goal)));
  STRATA_RETURN_IF_ERROR(Await([&] { return plans.last().has_value(); }, "path"));
  const CdrPath path = ReadPath(*plans.last());
  double length_m = 0.0;
  for (std::size_t i = 1; i < path.poses.size(); ++i) {
    length_m += (path.poses[i].translation() - path.poses[i - 1].translation()).norm();
  }
  std::cout << absl::StrFormat(
      "/strata/plan: frame %s, %d poses, %.1f m\n", path.header.frame, path.poses.size(), length_m);
  return absl::OkStatus();
}

int RobotMain(int argc, char** argv) {
  RobotOptions options;
  if (const char* domain = std::getenv("ROS_DOMAIN_ID")) options.domain = std::atoi(domain);
  CLI::App app("A robot of ROS 2, by Fast DDS, on this machine's loopback", "ros2-robot");
  app.require_subcommand(1);
  CLI::App* drive = app.add_subcommand("drive", "Publish clouds, odometry and the sensor's place");
  drive->add_option("FOLDER", options.folder, "What strata-simulate has written of a robot")
      ->required();
  drive->add_option("--hertz", options.hertz)->capture_default_str();
  CLI::App* hear = app.add_subcommand("hear", "Say what comes on /map, /strata/surfaces and /tf");
  CLI::App* goal = app.add_subcommand("goal", "Publish a goal in the map and say the path to it");
  goal->add_option("GOAL", options.goal)->type_name("X,Y,Z")->required();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = *drive  ? DriveAlong(options)
                              : *hear ? Hear(options)
                                      : AskForPath(options);
  if (status.ok()) return 0;
  std::cerr << "error: " << status.message() << std::endl;
  return 1;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  try {
    return strata::testing::RobotMain(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return 1;
  }
}
