// strata-simulate: scans of robots in a drawn world, as files that `strata scan import` takes.
//
//   OUT/places.txt                  "name x y z" of points on surfaces to plan between
//   OUT/classes.txt                 with --labels: "name=label", as --classes of `strata` takes it
//   OUT/ROBOT/scans/scan0000.pcd    in the sensor's frame; with --labels every point has one
//   OUT/ROBOT/poses_initial.txt     index-tum; odometry with noise from an exact start
//   OUT/ROBOT/poses_truth.txt       index-tum
#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <CLI/CLI.hpp>

#include "client/formats/file_bytes.h"
#include "core/common/status.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

struct Options {
  std::string world;
  std::filesystem::path out;
  std::uint64_t seed = 1;
  int districts = 1;
  double slab_m = 0.3;
  double wall_m = 0.1;
  std::vector<std::string> robots;
  RobotFiles files;
};

World WorldOf(const Options& options) {
  const std::string& name = options.world;
  if (name == "car_park") {
    return CarParkWorld(options.slab_m);
  }
  if (name == "rooms") {
    return RoomsWorld(options.wall_m, options.seed);
  }
  if (name == "building") {
    return BuildingWorld(options.seed);
  }
  if (name == "campus") {
    return CampusWorld(options.seed);
  }
  if (name == "city") {
    return CityWorld(options.districts, options.seed);
  }
  if (name == "campus_loop") {
    return CampusLoopWorld(options.seed);
  }
  if (name == "low_bridge") {
    return BridgeWorld({.parapets = true, .clearance_m = 1.5});
  }
  return BridgeWorld({.parapets = name == "bridge", .clearance_m = 3.0});
}

// Those asked for by name, or all of the world that do not drive loops.
absl::StatusOr<std::vector<Robot>> RobotsOf(const World& world,
                                            const std::vector<std::string>& names) {
  if (names.empty()) return world.robots;
  std::vector<Robot> all = world.robots;
  all.insert(all.end(), world.loops.begin(), world.loops.end());
  std::vector<Robot> chosen;
  for (const std::string& name : names) {
    const auto robot =
        std::find_if(all.begin(), all.end(), [&](const Robot& r) { return r.name == name; });
    if (robot == all.end()) {
      std::string known;
      for (const Robot& r : all) absl::StrAppend(&known, known.empty() ? "" : ", ", r.name);
      return absl::NotFoundError(
          absl::StrCat("no robot '", name, "' in this world; it has ", known));
    }
    chosen.push_back(*robot);
  }
  return chosen;
}

std::string ClassLines(const Scene& scene) {
  std::string lines;
  for (const std::uint16_t label : scene.Labels()) {
    absl::StrAppend(&lines, ToString(static_cast<WorldClass>(label)), "=", label, "\n");
  }
  return lines;
}

absl::Status Simulate(const Options& options) {
  const World world = WorldOf(options);
  STRATA_ASSIGN_OR_RETURN(const std::vector<Robot> robots, RobotsOf(world, options.robots));
  std::filesystem::create_directories(options.out);
  std::string places;
  for (const auto& [name, p] : world.places) {
    absl::StrAppendFormat(&places, "%s %.3f %.3f %.3f\n", name, p.x(), p.y(), p.z());
  }
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out / "places.txt", places));
  if (options.files.sensor.labelled) {
    STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out / "classes.txt", ClassLines(world.scene)));
  }
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const Robot& robot = robots[i];
    const std::filesystem::path folder = options.out / robot.name;
    STRATA_ASSIGN_OR_RETURN(
        const WrittenRobot written,
        WriteRobot(world.scene, robot, options.seed + 17 * i, options.files, folder));
    std::cout << "robot " << robot.name << ": " << written.scans << " scans, " << written.points
              << " points in " << folder.string() << std::endl;
  }
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Scans of robots in a drawn world", "strata-simulate");
  app.add_option("WORLD", options.world, "Which world")
      ->required()
      ->check(CLI::IsMember({"bridge",
                             "open_bridge",
                             "low_bridge",
                             "building",
                             "car_park",
                             "campus",
                             "campus_loop",
                             "city",
                             "rooms"}));
  app.add_option("OUT", options.out, "Folder to write to")->required();
  app.add_option("--seed",
                 options.seed,
                 "Of all noise, and of what campus, city, building and rooms look like")
      ->capture_default_str();
  app.add_flag("--labels", options.files.sensor.labelled, "Say of every point what it is of");
  app.add_option("--robot",
                 options.robots,
                 "Only these; the ones that drive loops (car_park: loop, bridge: eight) are "
                 " written only when asked for");
  app.add_option("--slab", options.slab_m, "Of the car park's upper storey [m]")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 2.0));
  app.add_option("--wall", options.wall_m, "Of the rooms [m]")
      ->capture_default_str()
      ->check(CLI::Range(0.02, 1.0));
  app.add_option("--districts", options.districts, "Of the city, a robot in each")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--scans", options.files.max_scans, "Of each robot, at most")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  app.add_option("--step", options.files.step_m, "Way between scans [m]")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--height", options.files.height_m, "Of the sensor [m]")
      ->check(CLI::Range(0.1, 10.0))
      ->capture_default_str();
  app.add_option(
         "--noise-m", options.files.noise.translation_sigma_m, "Odometry, a step and axis [m]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option(
         "--noise-rad", options.files.noise.rotation_sigma_rad, "Odometry, a step and axis [rad]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--rings", options.files.sensor.rings, "Beams of the sensor")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--columns", options.files.sensor.columns, "Azimuth steps of a turn")
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
