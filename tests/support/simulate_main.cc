// strata-simulate: scans of robots in a drawn world, as files that `strata scan import` takes.
//
//   OUT/places.txt                  "name x y z" of points on surfaces to plan between
//   OUT/ROBOT/scans/scan0000.pcd    in the sensor's frame
//   OUT/ROBOT/poses_initial.txt     index-tum; odometry with noise from an exact start
//   OUT/ROBOT/poses_truth.txt       index-tum
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <CLI/CLI.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"
#include "tests/support/simulator.h"
#include "tests/support/worlds.h"

namespace strata::testing {
namespace {

struct Options {
  std::string world;
  std::filesystem::path out;
  std::uint64_t seed = 1;
  double step_m = 1.0;
  double height_m = 1.2;
  OdometryNoise noise;
  SensorOptions sensor;
};

World WorldOf(const std::string& name, std::uint64_t seed) {
  if (name == "car_park") {
    return CarParkWorld();
  }
  if (name == "campus") {
    return CampusWorld(seed);
  }
  if (name == "low_bridge") {
    return BridgeWorld({.parapets = true, .clearance_m = 1.5});
  }
  return BridgeWorld({.parapets = name == "bridge", .clearance_m = 3.0});
}

std::string IndexTum(const std::vector<Pose>& poses, const std::string& comment) {
  std::string text = absl::StrCat("# ", comment, "\n# index time x y z qx qy qz qw\n");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d t = poses[i].translation();
    const Eigen::Quaterniond q(poses[i].linear());
    absl::StrAppendFormat(&text,
                          "%d %.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                          i,
                          static_cast<double>(i),
                          t.x(),
                          t.y(),
                          t.z(),
                          q.x(),
                          q.y(),
                          q.z(),
                          q.w());
  }
  return text;
}

absl::Status WriteRobot(const World& world,
                        const Robot& robot,
                        std::uint64_t seed,
                        const Options& options) {
  const std::filesystem::path folder = options.out / robot.name;
  std::filesystem::create_directories(folder / "scans");
  const std::vector<Pose> truth =
      Drive(world.scene, robot.waypoints, options.step_m, options.height_m);
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(folder / "poses_truth.txt", IndexTum(truth, "exact, simulated")));
  STRATA_RETURN_IF_ERROR(
      WriteFileBytes(folder / "poses_initial.txt",
                     IndexTum(NoisyOdometry(truth, options.noise, seed), "odometry, simulated")));
  std::size_t points = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const PointCloud cloud =
        SimulateScan(world.scene, options.sensor, truth[i], seed + 1000003 * (i + 1));
    points += cloud.size();
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, PcdBytes(GeometryOf(cloud)));
    STRATA_RETURN_IF_ERROR(
        WriteFileBytes(folder / "scans" / absl::StrFormat("scan%04d.pcd", i), bytes));
  }
  std::cout << "robot " << robot.name << ": " << truth.size() << " scans, " << points
            << " points in " << folder.string() << std::endl;
  return absl::OkStatus();
}

absl::Status Simulate(const Options& options) {
  const World world = WorldOf(options.world, options.seed);
  std::filesystem::create_directories(options.out);
  std::string places;
  for (const auto& [name, p] : world.places) {
    absl::StrAppendFormat(&places, "%s %.3f %.3f %.3f\n", name, p.x(), p.y(), p.z());
  }
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out / "places.txt", places));
  for (std::size_t i = 0; i < world.robots.size(); ++i) {
    STRATA_RETURN_IF_ERROR(WriteRobot(world, world.robots[i], options.seed + 17 * i, options));
  }
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Scans of robots in a drawn world", "strata-simulate");
  app.add_option("WORLD", options.world, "Which world")
      ->required()
      ->check(CLI::IsMember({"bridge", "open_bridge", "low_bridge", "car_park", "campus"}));
  app.add_option("OUT", options.out, "Folder to write to")->required();
  app.add_option("--seed", options.seed, "Of all noise")->capture_default_str();
  app.add_option("--step", options.step_m, "Way between scans [m]")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--height", options.height_m, "Of the sensor [m]")
      ->check(CLI::Range(0.1, 10.0))
      ->capture_default_str();
  app.add_option("--noise-m", options.noise.translation_sigma_m, "Odometry, a step and axis [m]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--noise-rad", options.noise.rotation_sigma_rad, "Odometry, a step and axis [rad]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--rings", options.sensor.rings, "Beams of the sensor")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--columns", options.sensor.columns, "Azimuth steps of a turn")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const absl::Status status = Simulate(options);
  if (!status.ok()) {
    std::cerr << "error: " << status.message() << std::endl;
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  try {
    return strata::testing::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << std::endl;
    return 1;
  }
}
