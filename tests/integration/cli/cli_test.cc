// Every verb of `strata` over the wire, as a script would call it.
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/integration/cli/cli_fixture.h"

namespace strata::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class VerbsTest : public CliTest {
 protected:
  // The bridge as its two robots saw it, in map "m".
  void SetUp() override {
    StartServer();
    Json({"map", "create", "m", "--cell-size", "0.1", "--gap-size", "1.0", "--thickness", "0.1"});
    RobotFiles files;
    files.step_m = 2.5;
    files.sensor.columns = 480;
    for (const char* robot : {"over", "under"}) {
      const std::uint64_t scans = WriteDrive(robot, files);
      const json summary = Json(ImportArguments("m", robot));
      EXPECT_EQ(summary.at("uploaded"), scans);
      EXPECT_EQ(summary.at("integrated"), scans);
      scans_ += scans;
    }
  }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
    return Path(name);
  }
  // A JSON value a line.
  std::vector<json> JsonLines(const std::vector<std::string>& arguments) const {
    const cli::Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    std::vector<json> values;
    std::istringstream lines(ran.out);
    for (std::string line; std::getline(lines, line);) {
      values.push_back(json::parse(line, nullptr, false));
      EXPECT_FALSE(values.back().is_discarded()) << line;
    }
    return values;
  }

  std::uint64_t scans_ = 0;
};

TEST_F(VerbsTest, MapsAndTheirFiles) {
  EXPECT_EQ(Json({"map", "list"}).at(0).at("name"), "m");
  const json shown = Json({"map", "show", "m"});
  EXPECT_EQ(shown.at("scans"), scans_);
  for (const char* count :
       {"points", "patches", "occupied_cells", "tiles", "tile_bytes", "point_bytes", "epoch"}) {
    EXPECT_GT(shown.at(count).get<std::uint64_t>(), 0U) << count;
  }
  EXPECT_EQ(Json({"map", "verify", "m"}).at("state"), "succeeded");
  EXPECT_EQ(Json({"map", "rebuild", "m"}).at("state"), "succeeded");
  EXPECT_EQ(Json({"map", "show", "m"}).at("content_digest"), shown.at("content_digest"));
  Json({"map", "render", "m", Path("m.png"), "--slice", "-1,2"});
  EXPECT_GT(std::filesystem::file_size(Path("m.png")), 1000U);
  for (const std::string format : {"ply", "obj", "pcd"}) {
    const std::string file = Path("m." + format);
    const json written = Json({"map", "export", "m", "--format", format, "--out", file});
    EXPECT_EQ(std::filesystem::file_size(file), written.at("bytes").get<std::size_t>());
  }
  for (const std::string surface : {"highest", "kalman", "ground"}) {
    const std::string file = Path(surface + ".tif");
    const json written =
        Json({"map", "export", "m", "--format", "geotiff", "--surface", surface, "--out", file});
    EXPECT_GT(written.at("cells"), 10'000);
    EXPECT_GT(std::filesystem::file_size(file), 10'000U);
  }
  const json octree =
      Json({"map", "export", "m", "--format", "bt", "--region=-3,-3,3,3", "--out", Path("m.bt")});
  EXPECT_EQ(std::filesystem::file_size(Path("m.bt")), octree.at("bytes").get<std::size_t>());
  EXPECT_EQ(Json({"map", "delete", "m"}).at("deleted"), "m");
  EXPECT_EQ(Json({"map", "list"}).size(), 0U);
}

TEST_F(VerbsTest, ScansPosesAndTiles) {
  EXPECT_EQ(Json({"scan", "list", "m", "--trajectory", "over"}).size() +
                Json({"scan", "list", "m", "--trajectory", "under"}).size(),
            scans_);
  const json scan = Json({"scan", "show", "m", "over/3"});
  EXPECT_EQ(scan.at("state"), "integrated");
  const json exported =
      Json({"scan", "export", "m", "over/3", "--format", "ply", "--out", Path("scan.ply")});
  EXPECT_EQ(exported.at("points"), scan.at("points"));

  EXPECT_EQ(Json({"pose", "list", "m"}).size(), scans_);
  Json({"pose", "export", "m", "--format", "tum", "--trajectory", "over", "--out", Path("tum")});
  std::ifstream tum(Path("tum"));
  std::ifstream truth(Path("over/poses_truth.txt"));
  std::string line;
  while (std::getline(truth, line)) {
    if (line.starts_with('#')) continue;
    std::istringstream expected(line.substr(line.find(' ')));
    for (int i = 0; i < 8; ++i) {
      double a = 0.0;
      double b = 0.0;
      ASSERT_TRUE(expected >> a && tum >> b);
      EXPECT_NEAR(a, b, 2e-9);
    }
  }
  Json({"pose", "set", "m", "over/3", "--pose", "-25,0,1.3,0,0,0,1"});
  EXPECT_EQ(Json({"scan", "show", "m", "over/3"}).at("pose").at(2), 1.3);
  EXPECT_EQ(Json({"map", "show", "m"}).at("epoch"), 2);

  const json tiles = Json({"tile", "list", "m"});
  ASSERT_GT(tiles.size(), 4U);
  const json tile = Json({"tile", "get", "m", tiles.at(0).at("key"), "--out", Path("tile")});
  EXPECT_EQ(std::filesystem::file_size(Path("tile")), tile.at("bytes").get<std::size_t>());
  EXPECT_EQ(Json({"scan", "delete", "m", "over/3"}).at("deleted"), "over/3");
  EXPECT_EQ(Json({"map", "show", "m"}).at("scans"), scans_ - 1);
}

TEST_F(VerbsTest, SurfacesPlansAndProfiles) {
  const json surfaces = Json({"surface", "m", "--at", "0,0"}).at("surfaces");
  ASSERT_EQ(surfaces.size(), 2U);
  EXPECT_NEAR(surfaces.at(0).at("z").get<double>(), 0.0, 0.05);
  EXPECT_NEAR(surfaces.at(1).at("z").get<double>(), 3.4, 0.05);
  EXPECT_EQ(JsonLines({"surface", "m", "--points", Write("points", "0,0\n0,-9\n")}).size(), 2U);

  const json over = Json({"plan", "m", "--from", "-26,0,0", "--to", "0,0,3.4", "--out", Path("p")});
  EXPECT_EQ(over.at("found"), true) << over;
  EXPECT_NEAR(over.at("waypoints").back().at(2).get<double>(), 3.4, 0.05);
  EXPECT_GT(std::filesystem::file_size(Path("p")), 100U);
  const json under = Json({"plan", "m", "--from", "0,-15,0", "--to", "0,15,0"});
  EXPECT_EQ(under.at("found"), true) << under;
  for (const json& waypoint : under.at("waypoints")) {
    EXPECT_NEAR(waypoint.at(2).get<double>(), 0.0, 0.05);
  }
  Json({"profile", "set", "m", "crane", "--height", "3.3"});
  EXPECT_EQ(Json({"profile", "list", "m"}).size(), 2U);
  const std::vector<json> plans = JsonLines({"plan",
                                             "m",
                                             "--profile",
                                             "crane",
                                             "--queries",
                                             Write("queries", "0,-15,0,0,15,0\n0,-15,0,0,-9,0\n")});
  ASSERT_EQ(plans.size(), 2U);
  EXPECT_EQ(plans[0].at("reason"), "blocked");
  EXPECT_EQ(plans[0].at("obstruction"), "clearance");
  EXPECT_NEAR(plans[0].at("obstruction_value").get<double>(), 3.0, 0.1);
  EXPECT_NEAR(plans[0].at("where").at(1).get<double>(), -2.0, 0.15);
  EXPECT_EQ(plans[1].at("found"), true) << plans[1];
}

TEST_F(VerbsTest, JobsAndExitCodes) {
  const json started = Json({"job", "start", "m", "verify"});
  const std::string id = std::to_string(started.at("id").get<int>());
  EXPECT_EQ(Json({"job", "watch", "m", id}).at("state"), "succeeded");
  EXPECT_EQ(Json({"job", "show", "m", id}).at("progress"), 1.0);
  EXPECT_EQ(Json({"job", "cancel", "m", id}).at("state"), "succeeded");
  EXPECT_EQ(Json({"job", "list", "m"}).size(), 1U);
  const std::vector<std::vector<std::string>> failing = {{"map", "show", "nowhere"},
                                                         {"map", "create", "m"},
                                                         {"map", "create", "../m"},
                                                         {"scan", "show", "m", "over/999"},
                                                         {"tile", "get", "m", "0/999/0"},
                                                         {"job", "show", "m", "99"}};
  for (const auto& words : failing) {
    SCOPED_TRACE(::testing::PrintToString(words));
    const cli::Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_EQ(ran.out, "");
    EXPECT_THAT(ran.err, HasSubstr("error: "));
  }
  const std::vector<std::vector<std::string>> misused = {
      {"map", "create"},
      {"plan", "m", "--from", "1,2"},
      {"plan", "m", "--from", "nan,0", "--to", "0,0"},
      {"scan", "show", "m", "over"},
      {"fly"}};
  for (const auto& words : misused) {
    SCOPED_TRACE(::testing::PrintToString(words));
    const cli::Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 2);
    EXPECT_EQ(ran.out, "");
  }
  server().Signal(SIGTERM);
  EXPECT_EQ(server().Wait(), 0);
  const cli::Ran ran = Run({"map", "list"});  // nobody is there
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.out, "");
}

}  // namespace
}  // namespace strata::testing
