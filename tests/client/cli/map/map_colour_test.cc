// Maps of scans with colours, as pictures and files.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/geometry_writer.h"
#include "client/formats/ply_reader.h"
#include "core/cloud/point_cloud.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class MapColourTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }

  Ran Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(arguments);
  }
  json RunOk(const std::vector<std::string>& arguments) const {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  // A map of 4 m × 4 m of floor, red in the west and green in the east.
  void Make(const std::string& map, bool coloured) const {
    Geometry floor;
    for (int i = 0; i < 80 * 80; ++i) {
      floor.vertices.emplace_back(
          -2.0 + 0.05 * (i % 80) + 0.01, -2.0 + 0.05 * (i / 80) + 0.01, -1.0);
      if (coloured) floor.colour.push_back(i % 80 < 40 ? kRed : kGreen);
    }
    std::ofstream(Path(map + ".ply"), std::ios::binary) << *PlyBytes(floor);
    RunOk({"map", "create", map});
    RunOk({"scan", "import", map, Path(map + ".ply"), "--wait"});
  }

  static constexpr Colour kRed = {200, 40, 32};
  static constexpr Colour kGreen = {16, 160, 80};
  testing::TempDir dir_;
};

bool Near(const Colour& a, const Colour& b) {
  return std::abs(a.r - b.r) <= 2 && std::abs(a.g - b.g) <= 2 && std::abs(a.b - b.b) <= 2;
}

TEST_F(MapColourTest, MeshesAndSurfacesHaveTheColoursOfThePoints) {
  Make("m", true);
  const std::string file = Path("mesh.ply");
  RunOk({"map", "export", "m", "--format", "ply", "--layer", "colour", "--out", file});
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud mesh, ReadPly(bytes.str()));
  ASSERT_EQ(mesh.colour.size(), mesh.points.size());
  ASSERT_GT(mesh.points.size(), 1000U);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (std::abs(mesh.points[i].x()) < 0.1F) continue;
    EXPECT_TRUE(Near(mesh.colour[i], mesh.points[i].x() < 0 ? kRed : kGreen)) << i;
  }
  const json surface = RunOk({"surface", "m", "--at", "-1.05,0.05"}).at("surfaces").at(0);
  EXPECT_EQ(surface.at("colour").get<std::string>().substr(0, 2), "#c");
  EXPECT_GT(RunOk({"map", "render", "m", Path("m.png"), "--layer", "colour"}).at("tiles"), 0);
}

TEST_F(MapColourTest, MeshesHaveNormals) {
  Make("m", false);
  RunOk({"map", "export", "m", "--format", "ply", "--out", Path("mesh.ply")});
  std::ostringstream bytes;
  bytes << std::ifstream(Path("mesh.ply"), std::ios::binary).rdbuf();
  EXPECT_THAT(bytes.str(), HasSubstr("property float nx\nproperty float ny\nproperty float nz\n"));
}

TEST_F(MapColourTest, AMapWithoutColoursSaysSo) {
  Make("grey", false);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"map", "render", "grey", Path("g.png"), "--layer", "colour"},
        {"map",
         "export",
         "grey",
         "--format",
         "obj",
         "--layer",
         "colour",
         "--out",
         Path("g.obj")}}) {
    const Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.err, HasSubstr("map grey has no colours: its scans have none"));
  }
  EXPECT_FALSE(std::filesystem::exists(Path("g.png")));
  EXPECT_TRUE(
      RunOk({"surface", "grey", "--at", "-1.05,0.05"}).at("surfaces").at(0).at("colour").is_null());
}

}  // namespace
}  // namespace strata::cli
