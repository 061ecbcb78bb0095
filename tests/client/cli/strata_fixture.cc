#include "tests/client/cli/strata_fixture.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/geometry_writer.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::cli {

using nlohmann::json;

Ran StrataTest::Run(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(), {"--embedded", database_, "--output", "json"});
  return RunStrata(arguments);
}

json StrataTest::RunOk(const std::vector<std::string>& arguments) const {
  const Ran ran = Run(arguments);
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  return json::parse(ran.out, nullptr, false);
}

std::string StrataTest::Write(const std::string& name, const std::string& bytes) const {
  const std::filesystem::path path = dir_.path() / name;
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
  return path.string();
}

std::string StrataTest::Contents(const std::string& file) {
  std::ostringstream contents;
  contents << std::ifstream(file, std::ios::binary).rdbuf();
  return contents.str();
}

void StrataTest::WriteDrive(int scans) {
  testing::Scene scene;
  scene.Add(testing::Box({-20, -20, -1}, {20, 20, 0}));
  scene.Add(testing::Box({-12, 6, 0}, {12, 7, 3}));
  scene.Add(testing::Box({-12, -7, 0}, {12, -6, 3}));
  scene.Add(testing::Box({9, -6, 0}, {10, 6, 3}));
  scene.Build();
  std::string poses = "# index time x y z qx qy qz qw\n";
  for (int i = 0; i < scans; ++i) {
    Pose T = Pose::Identity();
    T.translation() = Eigen::Vector3d(-4.0 + i, 0.0, 1.0);
    const PointCloud cloud = testing::SimulateScan(scene, {}, T, static_cast<std::uint64_t>(i));
    Write("scans/scan" + std::to_string(i) + ".pcd", *PcdBytes(GeometryOf(cloud)));
    poses += std::to_string(i) + " " + std::to_string(100 + i) + ".25 " +
             std::to_string(T.translation().x()) + " 0 1 0 0 0 1\n";
  }
  poses_ = Write("poses.txt", poses);
  scans_ = (dir_.path() / "scans").string();
}

json StrataTest::Import(const std::vector<std::string>& more) const {
  std::vector<std::string> arguments = {
      "scan", "import", "m", scans_, "--poses", poses_, "--trajectory", "t", "--wait"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunOk(arguments);
}

}  // namespace strata::cli
