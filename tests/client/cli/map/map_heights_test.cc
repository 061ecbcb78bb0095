// strata map export --format geotiff|asc|bt, as its users run it.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <queue>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

using Cell = std::pair<int, int>;  // column, row from below

// An ESRI ASCII grid, read by the book.
struct Grid {
  int width = 0;
  int height = 0;
  double x_m = 0.0;
  double y_m = 0.0;
  double cell_m = 0.0;
  std::map<Cell, double> values;

  explicit Grid(const std::string& path) {
    std::ifstream file(path);
    std::string key;
    double nothing = 0.0;
    file >> key >> width >> key >> height >> key >> x_m >> key >> y_m >> key >> cell_m >> key >>
        nothing;
    EXPECT_EQ(key, "NODATA_value");
    for (int row = height - 1; row >= 0; --row) {
      for (int column = 0; column < width; ++column) {
        double value = 0.0;
        EXPECT_TRUE(file >> value);
        if (value != nothing) values[{column, row}] = value;
      }
    }
  }
  Cell At(double x, double y) const {
    return {static_cast<int>(std::floor((x - x_m) / cell_m)),
            static_cast<int>(std::floor((y - y_m) / cell_m))};
  }
};

// Whether steps of at most 0.2 m up or down join two places over cells that are let.
bool Joined(const Grid& heights, Cell from, Cell to, const std::function<bool(Cell)>& let) {
  std::set<Cell> seen = {from};
  std::queue<Cell> open({from});
  while (!open.empty()) {
    const Cell cell = open.front();
    open.pop();
    if (cell == to) return true;
    for (const auto& [dx, dy] : std::vector<Cell>{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const Cell next = {cell.first + dx, cell.second + dy};
      const auto height = heights.values.find(next);
      if (height == heights.values.end() || !let(next) || seen.contains(next)) continue;
      if (std::abs(height->second - heights.values.at(cell)) > 0.2) continue;
      seen.insert(next);
      open.push(next);
    }
  }
  return false;
}

// The bridge of the demo, as two robots saw it; its deck is 3.4 m high over |x| < 6, |y| < 2.
class MapHeightsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new testing::TempDir();
    const testing::World world = testing::BridgeWorld();
    testing::RobotFiles files;
    files.step_m = 1.5;
    files.sensor.columns = 480;
    for (const testing::Robot& robot : world.robots) {
      STRATA_ASSERT_OK(testing::WriteRobot(world.scene, robot, 1, files, Path(robot.name)));
    }
    Make("bridge", {"--cell-size", "0.2"});
  }
  static void TearDownTestSuite() {
    delete dir_;
    dir_ = nullptr;
  }
  static void Make(const std::string& map, const std::vector<std::string>& options) {
    std::vector<std::string> create = {"map", "create", map};
    create.insert(create.end(), options.begin(), options.end());
    RunOk(create);
    for (const std::string robot : {"over", "under"}) {
      RunOk({"scan",
             "import",
             map,
             Path(robot + "/scans"),
             "--poses",
             Path(robot + "/poses_truth.txt"),
             "--trajectory",
             robot,
             "--align",
             "off",
             "--wait"});
    }
  }

  static std::string Path(const std::string& name) { return (dir_->path() / name).string(); }
  static Ran Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(arguments);
  }
  static json RunOk(const std::vector<std::string>& arguments) {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  static json Export(const std::string& map,
                     std::vector<std::string> more,
                     const std::string& file) {
    std::vector<std::string> arguments = {"map", "export", map, "--out", Path(file)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunOk(arguments);
  }
  static std::string Refusal(std::vector<std::string> more, int exit_code = 1) {
    std::vector<std::string> arguments = {"map", "export"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, exit_code) << ran.out;
    return ran.err;
  }

  static testing::TempDir* dir_;
};
testing::TempDir* MapHeightsTest::dir_ = nullptr;

// Thesis, Fig. 6.1.
TEST_F(MapHeightsTest, HighestClosesTheUnderpassGroundOpensItTheMapHasBoth) {
  const auto ways = [](const Grid& heights, const std::function<bool(Cell)>& passable) {
    const auto within = [&](double half_x, double half_y) {
      return [&, half_x, half_y](Cell cell) {
        const double x = heights.x_m + (cell.first + 0.5) * heights.cell_m;
        const double y = heights.y_m + (cell.second + 0.5) * heights.cell_m;
        return std::abs(x) < half_x && std::abs(y) < half_y && passable(cell);
      };
    };
    const bool over =
        Joined(heights, heights.At(-25.9, 0.1), heights.At(25.9, 0.1), within(30, 1.5));
    const bool under =
        Joined(heights, heights.At(0.1, -18.9), heights.At(0.1, 18.9), within(5, 30));
    return std::pair(over, under);
  };
  Export("bridge", {"--format", "asc"}, "highest.asc");
  const Grid highest(Path("highest.asc"));
  EXPECT_EQ(ways(highest, [](Cell) { return true; }), std::pair(true, false));
  EXPECT_NEAR(highest.values.at(highest.At(0.1, 0.1)), 3.4, 0.03);

  const json written = Export("bridge", {"--format", "asc", "--surface", "ground"}, "ground.asc");
  EXPECT_EQ(written.at("files").size(), 3U);  // nowhere on earth
  const Grid ground(Path("ground.asc"));
  const Grid classes(Path("ground-class.asc"));
  EXPECT_EQ(ways(ground,
                 [&](Cell cell) {
                   const double c = classes.values.at(cell);
                   return c == 1 || c == 4;
                 }),
            std::pair(false, true));
  EXPECT_NEAR(ground.values.at(ground.At(0.1, 0.1)), 0.0, 0.03);
  EXPECT_EQ(classes.values.at(classes.At(0.1, 0.1)), 4);
  EXPECT_EQ(classes.values.at(classes.At(0.1, -8.1)), 1);
  EXPECT_EQ(ground.values.size(), highest.values.size());

  EXPECT_TRUE(RunOk({"plan", "bridge", "--from=-26,0,0", "--to", "26,0,0"}).at("found"));
  EXPECT_TRUE(RunOk({"plan", "bridge", "--from", "0,-19,0", "--to", "0,19,0"}).at("found"));
}

TEST_F(MapHeightsTest, AGroundIsForOneRobot) {
  RunOk({"profile", "set", "bridge", "tall", "--height", "3.5"});
  Export("bridge", {"--format", "asc", "--surface", "ground", "--profile", "tall"}, "tall.asc");
  const Grid tall(Path("tall.asc"));
  EXPECT_NEAR(tall.values.at(tall.At(0.1, 0.1)), 3.4, 0.03);
}

TEST_F(MapHeightsTest, FusedHeightsAndTheirSigma) {
  Export("bridge", {"--format", "asc", "--surface", "kalman"}, "kalman.asc");
  const Grid heights(Path("kalman.asc"));
  const Grid sigma(Path("kalman-sigma.asc"));
  for (const auto& [x, y] : {std::pair(0.1, 0.1), std::pair(0.1, -8.1)}) {
    const json surfaces =
        RunOk({"surface", "bridge", "--at", std::to_string(x) + "," + std::to_string(y)})
            .at("surfaces");
    double information = 0.0, weighted = 0.0;
    for (const json& surface : surfaces) {
      const double weight = 1.0 / std::pow(surface.at("sigma_m").get<double>(), 2);
      information += weight;
      weighted += weight * surface.at("z").get<double>();
    }
    EXPECT_NEAR(heights.values.at(heights.At(x, y)), weighted / information, 1e-3);
    EXPECT_NEAR(sigma.values.at(sigma.At(x, y)), 1.0 / std::sqrt(information), 1e-4);
  }
}

TEST_F(MapHeightsTest, RegionsAndLevels) {
  const json part = Export("bridge", {"--format", "asc", "--region=-6,-4,6.1,4"}, "part.asc");
  const Grid grid(Path("part.asc"));
  EXPECT_NEAR(grid.x_m, -6.0, 1e-9);
  EXPECT_NEAR(grid.y_m, -4.0, 1e-9);
  EXPECT_EQ(part.at("width"), 60);  // the middle of the 61st is at 6.1
  EXPECT_EQ(part.at("height"), 40);
  const json whole = Export("bridge", {"--format", "geotiff"}, "whole.tif");
  const json coarse = Export("bridge", {"--format", "geotiff", "--level", "2"}, "coarse.tif");
  EXPECT_NEAR(coarse.at("width").get<double>(), whole.at("width").get<double>() / 4.0, 1.0);
  EXPECT_NEAR(coarse.at("cell_size_m").get<double>(), 0.8, 1e-12);
  const json low =
      Export("bridge", {"--format", "geotiff", "--region=-90,-90,90,90,-1,1"}, "low.tif");
  EXPECT_LT(low.at("high"), 1.01);
  EXPECT_LT(low.at("cells"), whole.at("cells"));
}

TEST_F(MapHeightsTest, WithAnOriginHeightsAreAboveTheEllipsoid) {
  Make("earth", {"--cell-size", "0.2", "--origin", "52.5,13.4,34"});
  const json plain = Export("bridge", {"--format", "asc"}, "plain.asc");
  const json earth = Export("earth", {"--format", "asc"}, "earth.asc");
  EXPECT_EQ(earth.at("files").size(), 4U);
  EXPECT_THAT(earth.at("projection").get<std::string>(), HasSubstr("Transverse_Mercator"));
  EXPECT_TRUE(std::filesystem::exists(Path("earth.prj")));
  EXPECT_TRUE(std::filesystem::exists(Path("earth-sigma.prj")));
  EXPECT_FALSE(plain.contains("projection"));
  const Grid a(Path("plain.asc"));
  const Grid b(Path("earth.asc"));
  for (const auto& [x, y] : {std::pair(0.1, 0.1), std::pair(0.1, -18.1)}) {
    EXPECT_NEAR(b.values.at(b.At(x, y)), a.values.at(a.At(x, y)) + 34.0, 1e-3);
  }
}

TEST_F(MapHeightsTest, OctreesHaveFreeSpace) {
  const json all = Export("bridge", {"--format", "bt"}, "bridge.bt");
  EXPECT_EQ(std::filesystem::file_size(Path("bridge.bt")), all.at("bytes").get<std::size_t>());
  EXPECT_GT(all.at("free_m3"), 10.0 * all.at("occupied_m3").get<double>());
  // Between road and deck, both out of it.
  const json under = Export("bridge", {"--format", "bt", "--region=-2,-2,2,2,0.5,2.7"}, "under.bt");
  EXPECT_EQ(under.at("occupied_m3"), 0.0);
  EXPECT_NEAR(under.at("free_m3").get<double>(), 4.0 * 4.0 * 2.2, 2.0);
  EXPECT_NEAR(
      Export("bridge", {"--format", "bt", "--level", "1"}, "coarse.bt").at("voxel_m").get<double>(),
      0.4,
      1e-9);
  const json free = Export("bridge", {"--format", "octomap", "--free"}, "free.bt");
  EXPECT_EQ(free.at("nodes"), all.at("nodes"));
  const json hit = Export("bridge", {"--format", "octomap"}, "hit.bt");
  EXPECT_EQ(hit.at("free_m3"), 0.0);
  EXPECT_EQ(hit.at("occupied_m3"), all.at("occupied_m3"));
  EXPECT_THAT(Refusal({"bridge", "--format", "pcd", "--free", "--out", Path("no.pcd")}),
              HasSubstr("--free"));
  EXPECT_THAT(Refusal({"empty", "--format", "bt", "--out", Path("no.bt")}), HasSubstr("empty"));
  EXPECT_THAT(
      Refusal({"bridge", "--format", "bt", "--out", Path("no.bt"), "--region", "500,500,501,501"}),
      HasSubstr("the map lies within"));
}

TEST_F(MapHeightsTest, WhatCannotBeExportedSaysWhy) {
  const std::string out = Path("no.tif");
  RunOk({"map", "create", "empty"});
  EXPECT_THAT(Refusal({"empty", "--format", "geotiff", "--out", out}), HasSubstr("import scans"));
  EXPECT_THAT(Refusal({"empty", "--format", "asc", "--out", out, "--region", "0,0,1,1"}),
              HasSubstr("import scans"));
  EXPECT_THAT(Refusal({"empty", "--format", "asc", "--surface", "ground", "--out", out}),
              HasSubstr("import scans"));
  EXPECT_THAT(Refusal({"bridge", "--format", "asc", "--out", out, "--region", "500,500,501,501"}),
              HasSubstr("the map lies within"));
  EXPECT_THAT(Refusal({"bridge", "--format", "asc", "--out", out, "--region=-9,-9,9,9,70,80"}),
              HasSubstr("no surface of map bridge lies in the region"));
  EXPECT_THAT(Refusal({"bridge", "--format", "geotiff", "--out", out, "--surface", "lowest"}, 2),
              HasSubstr("highest,kalman,ground"));
  EXPECT_THAT(Refusal({"bridge", "--format", "geotiff", "--out", out, "--region", "1,1,0,2"}, 2),
              HasSubstr("X0 < X1"));
  EXPECT_THAT(Refusal({"bridge", "--format", "geotiff", "--out", Path("nowhere/no.tif")}),
              HasSubstr("nowhere/no.tif"));
  EXPECT_THAT(Refusal({"bridge", "--format", "asc", "--out", Path("nowhere/no.asc")}),
              HasSubstr("nowhere/no.asc"));
  EXPECT_THAT(
      Refusal({"bridge", "--format", "asc", "--out", out, "--surface", "ground", "--level", "1"}),
      HasSubstr("--level"));
  EXPECT_THAT(
      Refusal({"bridge", "--format", "asc", "--out", out, "--surface", "ground", "--profile", "x"}),
      HasSubstr("profile"));
  EXPECT_THAT(Refusal({"gone", "--format", "asc", "--out", out}), HasSubstr("gone"));
}

TEST_F(MapHeightsTest, OptionsThatAFormatDoesNotHearAreRefused) {
  const std::string out = Path("no.out");
  const auto refusal = [&](const std::string& format, std::vector<std::string> option) {
    std::vector<std::string> arguments = {"bridge", "--format", format, "--out", out};
    arguments.insert(arguments.end(), option.begin(), option.end());
    return Refusal(arguments);
  };
  EXPECT_THAT(refusal("ply", {"--region", "0,0,1,1"}),
              HasSubstr("--region says nothing to --format ply; leave it out, or take geotiff"));
  EXPECT_THAT(refusal("bt", {"--surface", "ground"}), HasSubstr("take geotiff, asc"));
  EXPECT_THAT(refusal("pcd", {"--level", "1"}), HasSubstr("--level"));
  EXPECT_THAT(refusal("geotiff", {"--mode", "scale"}), HasSubstr("take nav2"));
  EXPECT_THAT(refusal("asc", {"--at", "0,0,0"}), HasSubstr("--at"));
  EXPECT_THAT(refusal("stl", {"--layer", "colour"}), HasSubstr("ply, obj, glb"));
  EXPECT_THAT(refusal("bt", {"--relative-to", "0,0,1"}), HasSubstr("--relative-to"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace strata::cli
