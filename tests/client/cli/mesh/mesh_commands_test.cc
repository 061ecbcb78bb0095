// strata map mesh, scan mesh and scan heights, as their users run them.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/cloud/point_cloud.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// x y z as a PCD file that keeps its rows.
std::string OrganisedPcd(const PointCloud& cloud) {
  std::string pcd = absl::StrFormat(
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH %d\nHEIGHT %d\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS %d\nDATA ascii\n",
      cloud.columns,
      cloud.rows,
      cloud.size());
  for (const Eigen::Vector3f& p : cloud.points) {
    if (p.allFinite()) {
      absl::StrAppendFormat(&pcd, "%.5f %.5f %.5f\n", p.x(), p.y(), p.z());
    } else {
      pcd += "nan nan nan\n";
    }
  }
  return pcd;
}

// A room of 8 × 8 m, open above, with a chest of 1 × 1 × 0.8 m in it, seen from five places.
class MeshCommandsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new testing::TempDir();
    testing::Scene scene;
    scene.Add(testing::Labelled(testing::Box({-5, -5, -0.5}, {5, 5, 0}), 1));
    scene.Add(testing::Labelled(testing::Box({4, -5, 0}, {4.5, 5, 2}), 2));
    scene.Add(testing::Labelled(testing::Box({-4.5, -5, 0}, {-4, 5, 2}), 2));
    scene.Add(testing::Labelled(testing::Box({-5, 4, 0}, {5, 4.5, 2}), 2));
    scene.Add(testing::Labelled(testing::Box({-5, -4.5, 0}, {5, -4, 2}), 2));
    scene.Add(testing::Labelled(testing::Box({-0.5, -0.5, 0}, {0.5, 0.5, 0.8}), 3));
    scene.Build();
    testing::SensorOptions sensor;
    sensor.elevation_min_rad = -1.2;
    sensor.rings = 160;
    sensor.organised = true;
    sensor.sigma_m = 0.005;
    sensor.labelled = true;
    std::string poses;
    const std::vector<Eigen::Vector3d> places = {
        {2.5, 2.5, 1.4}, {-2.5, 2.5, 1.4}, {-2.5, -2.5, 1.4}, {2.5, -2.5, 1.4}, {0, 0, 2.4}};
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Pose T = Pose(Eigen::Translation3d(places[i]));
      PointCloud cloud = testing::SimulateScan(scene, sensor, T, i);
      const std::string name = absl::StrFormat("scan%d.pcd", i);
      Write("organised/" + name, OrganisedPcd(cloud));
      cloud.rows = cloud.columns = 0;
      if (i > 0) cloud.colour.assign(cloud.size(), {200, 100, 50});
      Write("scans/" + name, *PcdBytes(GeometryOf(cloud)));
      absl::StrAppendFormat(
          &poses, "%d %d %f %f %f 0 0 0 1\n", i, i, places[i].x(), places[i].y(), places[i].z());
    }
    Write("poses.txt", "# index time x y z qx qy qz qw\n" + poses);
    Import("room", "scans");
    Import("grids", "organised");
  }
  static void TearDownTestSuite() {
    delete dir_;
    dir_ = nullptr;
  }

  static std::string Path(const std::string& name) { return (dir_->path() / name).string(); }
  static void Write(const std::string& name, const std::string& bytes) {
    std::filesystem::create_directories(std::filesystem::path(Path(name)).parent_path());
    std::ofstream(Path(name), std::ios::binary) << bytes;
  }
  static Ran Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(arguments);
  }
  static json RunOk(const std::vector<std::string>& arguments) {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  static void Import(const std::string& map, const std::string& folder) {
    RunOk({"map", "create", map});
    RunOk({"scan",
           "import",
           map,
           Path(folder),
           "--poses",
           Path("poses.txt"),
           "--trajectory",
           "t",
           "--align",
           "off",
           "--wait"});
  }
  // What is said where `arguments` fail.
  static std::string Refusal(const std::vector<std::string>& arguments) {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 1) << ran.out;
    return ran.err;
  }

  static testing::TempDir* dir_;
};
testing::TempDir* MeshCommandsTest::dir_ = nullptr;

TEST_F(MeshCommandsTest, EveryMethodWritesItsSurface) {
  const json tsdf = RunOk({"map", "mesh", "room", Path("a.ply")});
  EXPECT_EQ(tsdf["method"], "tsdf");
  EXPECT_EQ(tsdf["scans"], 5);
  EXPECT_FALSE(tsdf["closed"]);
  EXPECT_GT(tsdf["boundary_edges"], 0);
  EXPECT_EQ(tsdf["nonmanifold_edges"], 0);
  // Floor, walls and chest.
  EXPECT_NEAR(tsdf["area_m2"].get<double>(), 64.0 + 4 * 16.0 + 3.2, 0.08 * 131.0);
  EXPECT_EQ(std::filesystem::file_size(Path("a.ply")), tsdf["bytes"]);
  EXPECT_TRUE(tsdf["coloured"]);
  const json contour = RunOk({"map", "mesh", "room", Path("a.obj"), "--method", "contour"});
  EXPECT_TRUE(contour["closed"]);
  EXPECT_GT(contour["volume_m3"], 10.0);
  const json alpha =
      RunOk({"map", "mesh", "room", Path("a.stl"), "--method", "alpha", "--voxel", "0.1"});
  EXPECT_GT(alpha["alpha_m2"], 0.01);
  EXPECT_GT(alpha["triangles"], 10'000);
  EXPECT_EQ(std::filesystem::file_size(Path("a.stl")), 84 + 50 * alpha["triangles"].get<int>());
}

TEST_F(MeshCommandsTest, PartsClassesAndFewerTriangles) {
  const std::string chest = "--region=-0.7,-0.7,0.7,0.7,0.05,2";
  const json part = RunOk({"map", "mesh", "room", Path("b.glb"), chest});
  EXPECT_NEAR(part["area_m2"].get<double>(), 1.0 + 4 * 0.75, 0.6);
  const json of_class = RunOk({"map", "mesh", "room", Path("b.glb"), "--class", "3"});
  EXPECT_NEAR(of_class["area_m2"].get<double>(), 1.0 + 4 * 0.8, 0.8);
  const json fewer = RunOk({"map", "mesh", "room", Path("b.glb"), chest, "--simplify", "500"});
  EXPECT_LE(fewer["triangles"], 500);
  EXPECT_NEAR(fewer["area_m2"].get<double>(), part["area_m2"].get<double>(), 0.2);
  const json moved =
      RunOk({"map", "mesh", "room", Path("b.obj"), chest, "--relative-to", "100,0,0"});
  EXPECT_THAT(moved["relative_to"], ::testing::ElementsAre(100.0, 0.0, 0.0));
}

TEST_F(MeshCommandsTest, AScanInItsOwnFrame) {
  const json grid = RunOk({"scan", "mesh", "grids", "t/4", Path("c.ply"), "--method", "organised"});
  EXPECT_GT(grid["triangles"], 50'000);
  EXPECT_FALSE(grid["coloured"]);
  EXPECT_EQ(grid["scans"], 1);
  const json tsdf = RunOk({"scan", "mesh", "room", "t/4", Path("c.glb")});
  EXPECT_GT(tsdf["triangles"], 10'000);
  EXPECT_THAT(Refusal({"scan", "mesh", "room", "t/4", Path("c.ply"), "--method", "organised"}),
              HasSubstr("no rows and columns"));
  EXPECT_THAT(Refusal({"scan", "mesh", "room", "t/99", Path("c.ply")}), HasSubstr("t/99"));
}

// Thesis, 6.3.1: interpolated, the floor between two beams has a height, too.
TEST_F(MeshCommandsTest, WhatAScanSawAsHeights) {
  const auto heights = [](const std::string& surface) {
    return RunOk({"scan",
                  "heights",
                  "grids",
                  "t/4",
                  "--format",
                  "asc",
                  "--cell-size",
                  "0.02",
                  "--surface",
                  surface,
                  "--out",
                  Path(surface + ".asc")});
  };
  const json highest = heights("highest");
  const json interpolated = heights("interpolated");
  EXPECT_GT(interpolated["cells"].get<int>(), 2 * highest["cells"].get<int>());
  EXPECT_GT(interpolated["cells"].get<int>(), 300 * 300);  // of 400 x 400 in the room
  EXPECT_EQ(heights("kalman")["cells"], highest["cells"]);
  for (const json& report : {highest, interpolated}) {
    // In the map: the scan was taken at (0, 0, 2.4), and sees over the walls.
    EXPECT_NEAR(report["low"].get<double>(), 0.0, 0.1);
    EXPECT_NEAR(report["high"].get<double>(), 2.0, 0.1);
    EXPECT_NEAR(report["corner"][0].get<double>(), -5.0, 0.1);
    EXPECT_NEAR(report["width"].get<double>() * 0.02, 10.0, 0.2);
    EXPECT_THAT(report["files"], ::testing::SizeIs(2));
  }
  const std::string out = Path("no.tif");
  EXPECT_THAT(
      Refusal({"scan", "heights", "room", "t/4", "--surface", "interpolated", "--out", out}),
      HasSubstr("scan t/4 has no rows and columns; take --surface highest or kalman"));
  EXPECT_THAT(Refusal({"scan", "heights", "room", "t/99", "--out", out}), HasSubstr("t/99"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(MeshCommandsTest, WhatCannotBeMeshedSaysWhy) {
  const std::string out = Path("d.ply");
  RunOk({"map", "create", "empty"});
  EXPECT_THAT(Refusal({"map", "mesh", "empty", out}), HasSubstr("no integrated scans"));
  RunOk({"map", "create", "dropped", "--drop-points"});
  RunOk({"scan",
         "import",
         "dropped",
         Path("scans"),
         "--poses",
         Path("poses.txt"),
         "--align",
         "off",
         "--wait"});
  EXPECT_THAT(Refusal({"map", "mesh", "dropped", out}), HasSubstr("has dropped the points"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", out, "--region", "100,100,110,110"}),
              HasSubstr("the map lies within"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", out, "--region=-3,-3,3,3,50,60"}),
              HasSubstr("no points in the region"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", out, "--voxel", "0.001", "--region", "2,2,3,3"}),
              HasSubstr("larger ones may do"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", out, "--method", "alpha", "--voxel", "0.001"}),
              HasSubstr("at most 200000"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", Path("d.fbx")}),
              HasSubstr(".ply, .obj, .stl and .glb"));
  EXPECT_THAT(Refusal({"map", "mesh", "nowhere", out}), HasSubstr("nowhere"));
  EXPECT_THAT(Refusal({"map", "mesh", "room", out, "--class", "lamp"}), HasSubstr("lamp"));
  EXPECT_FALSE(std::filesystem::exists(out));
  for (const char* region : {"1,2,3", "3,0,1,1", "0,0,1,1,2", "0,0,nan,1"}) {
    EXPECT_EQ(Run({"map", "mesh", "room", out, "--region", region}).exit_code, 2) << region;
  }
  EXPECT_EQ(Run({"map", "mesh", "room", out, "--voxel", "0"}).exit_code, 2);
}

}  // namespace
}  // namespace strata::cli
