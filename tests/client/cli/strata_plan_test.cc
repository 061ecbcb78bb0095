// strata surface, plan, path and profile, as their users run them.
#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/bags/bag_reader.h"
#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/strata_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

class StrataPlanTest : public StrataTest {};

TEST_F(StrataPlanTest, PathsAreCheckedFromTheirFiles) {
  WriteDrive(8);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const std::string path = (dir_.path() / "path.ply").string();
  const json plan = RunOk({"plan", "m", "--from", "-4,0.5,0", "--to", "3,-0.5,0", "--out", path});
  ASSERT_EQ(plan["found"], true) << plan;
  const json check = RunOk({"path", "check", "m", path});
  EXPECT_EQ(check["valid"], true) << check;
  EXPECT_NEAR(check["length_m"].get<double>(), plan["length_m"].get<double>(), 0.01);
  const json wide = RunOk({"path", "check", "m", path, "--radius", "5"});
  EXPECT_EQ(wide["valid"], false);
  EXPECT_TRUE(wide.contains("where"));
  EXPECT_EQ(Run({"path", "check", "m", path + "x"}).exit_code, 1);
}

TEST_F(StrataPlanTest, ShapesAreHeldAgainstTheMap) {
  WriteDrive(8);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const std::string path = (dir_.path() / "path.ply").string();
  const json plan = RunOk({"plan",
                           "m",
                           "--from",
                           "-4,0.5,0",
                           "--to",
                           "3,-0.5,0",
                           "--out",
                           path,
                           "--shape-box",
                           "0.4,0.4,0.5"});
  ASSERT_EQ(plan.at("found"), true) << plan;
  EXPECT_EQ(plan.at("shape").at("free"), true) << plan;
  const json wide = RunOk({"path", "check", "m", path, "--shape-box", "1,30,1"});
  EXPECT_EQ(wide.at("valid"), true);
  ASSERT_EQ(wide.at("shape").at("free"), false) << wide;
  EXPECT_GE(wide.at("shape").at("contacts").at(0).at("depth_m").get<double>(), 0.0);
  const auto refused = Run({"path", "check", "m", path, "--shape", "cart.doc"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, ::testing::HasSubstr(".urdf"));
}

TEST_F(StrataPlanTest, ExploreSaysWhereToLook) {
  WriteDrive(8);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const json views = RunOk(
      {"explore", "m", "--from", "-4,0.5,0", "--count", "2", "--range", "8", "--min-bits", "10"});
  ASSERT_EQ(views.at("reason"), "views") << views;
  ASSERT_EQ(views.at("views").size(), 2U);
  EXPECT_GT(views.at("views").at(0).at("gain_bits").get<double>(), 10.0);
  EXPECT_EQ(views.at("views").at(0).at("pose").size(), 7U);
  const json off = RunOk({"explore", "m", "--from", "400,0.5,0"});
  EXPECT_EQ(off.at("reason"), "start_not_on_surface");
  EXPECT_NE(Run({"explore", "m", "--from", "-4,0.5,0", "--count", "0"}).exit_code, 0);
  const auto huge = Run({"explore", "m", "--from", "-4,0.5,0", "--resolution", "0.01"});
  EXPECT_EQ(huge.exit_code, 1);
  EXPECT_THAT(huge.err, ::testing::HasSubstr("take a resolution of"));
}

TEST_F(StrataPlanTest, SurfacePlanRenderAndExportOfADrive) {
  WriteDrive(8);
  RunOk({"map", "create", "m"});
  Import();
  const json column = RunOk({"surface", "m", "--at", "-2.05,0.05"});
  ASSERT_EQ(column.at("surfaces").size(), 1U);
  EXPECT_NEAR(column.at("surfaces").at(0).at("z").get<double>(), 0.0, 0.05);

  const std::string path = (dir_.path() / "path.ply").string();
  const json plan = RunOk({"plan", "m", "--from", "-4,0.5,0", "--to", "3,-0.5,0", "--out", path});
  ASSERT_EQ(plan.at("found"), true) << plan.dump();
  EXPECT_NEAR(plan.at("length_m").get<double>(), 7.07, 0.5);
  EXPECT_EQ(plan.at("waypoints").at(0).size(), 3U);

  const json blocked = RunOk({"plan", "m", "--from", "-4,0,0", "--to", "900,0,0"});
  EXPECT_EQ(blocked.at("found"), false);

  const std::string queries = Write("queries.csv", "-4,0,0,3,0,0\n-4,0,0,900,0,0\n");
  const Ran many = Run({"plan", "m", "--queries", queries});
  EXPECT_EQ(many.exit_code, 0);
  std::istringstream lines(many.out);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(json::parse(line).at("found"), true);
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(json::parse(line).at("found"), false);

  const std::string refused = Write("refused.csv", "1e300,0,0,3,0,0\n-4,0,0,3,0,0\n");
  const Ran some = Run({"plan", "m", "--queries", refused});
  EXPECT_EQ(some.exit_code, 1);
  std::istringstream answers(some.out);
  ASSERT_TRUE(std::getline(answers, line));
  EXPECT_EQ(json::parse(line).at("reason"), "error");
  EXPECT_EQ(json::parse(line).at("found"), false);
  ASSERT_TRUE(std::getline(answers, line));
  EXPECT_EQ(json::parse(line).at("found"), true);

  const std::string places = Write("places.csv", "x,y\n-2.05,0.05\n500,0\n-3.05,0.05\n");
  const Ran table = RunStrata({"surface", "m", "--points", places, "--embedded", database_});
  EXPECT_EQ(std::count(table.out.begin(), table.out.end(), '\n'), 3) << table.out;
  const Ran each = Run({"surface", "m", "--points", places});
  EXPECT_EQ(std::count(each.out.begin(), each.out.end(), '\n'), 3) << each.out;

  const std::string png = (dir_.path() / "map.png").string();
  EXPECT_EQ(RunOk({"map", "render", "m", png, "--path", path}).at("paths"), 1);
  EXPECT_GT(std::filesystem::file_size(png), 5000U);
  for (const std::string format : {"ply", "obj", "stl", "glb", "pcd"}) {
    const std::string file = (dir_.path() / ("map." + format)).string();
    const json written = RunOk({"map", "export", "m", "--format", format, "--out", file});
    EXPECT_EQ(std::filesystem::file_size(file), written.at("bytes").get<std::size_t>());
    EXPECT_GT(written.at("vertices").get<std::size_t>(), 1000U);
  }
  const std::string far = (dir_.path() / "far.pcd").string();
  const std::vector<std::string> shifted = {
      "map", "export", "m", "--format", "pcd", "--out", far, "--relative-to"};
  const auto exported = [&](const std::string& origin) {
    std::vector<std::string> words = shifted;
    words.push_back(origin);
    return RunOk(words).at("coordinates");
  };
  EXPECT_EQ(exported("1,2,3"), "float");
  EXPECT_EQ(exported("-500000,0,0"), "double");
}

// Topics and how many messages they have.
std::map<std::string, int> TopicsOf(const std::string& file) {
  std::map<std::string, int> topics;
  const auto bag = OpenBagFile(file);
  EXPECT_THAT(bag, testing::IsOk());
  EXPECT_THAT((*bag)->Visit([&](const BagMessage& message) {
    ++topics[(*bag)->topics()[message.topic].name];
    return absl::OkStatus();
  }),
              testing::IsOk());
  EXPECT_THAT((*bag)->damage(), ::testing::IsEmpty());
  return topics;
}

TEST_F(StrataPlanTest, ADriveIsExportedForFoxglove) {
  WriteDrive(8);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const auto mcap = [this](const std::string& name) { return (dir_.path() / name).string(); };
  const std::vector<std::string> words = {"map", "export", "m", "--format", "mcap", "--out"};
  const auto exported = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return RunOk(more);
  };
  const json map = exported({mcap("map.mcap")});
  EXPECT_EQ(map.at("poses"), 8);
  EXPECT_EQ(std::filesystem::file_size(mcap("map.mcap")), map.at("bytes").get<std::size_t>());
  const json ply = RunOk({"map", "export", "m", "--format", "ply", "--out", mcap("map.ply")});
  EXPECT_GE(map.at("points").get<int>(), ply.at("vertices").get<int>());  // and walls
  const std::string trajectory = RunOk({"pose", "list", "m"})[0].at("id").get<std::string>();
  const std::string drive = "/trajectories/" + trajectory.substr(0, trajectory.find('/'));
  EXPECT_EQ(TopicsOf(mcap("map.mcap")),
            (std::map<std::string, int>{{"/surfaces", 1}, {drive, 1}, {"/tf", 8}}));
  EXPECT_LT(exported({mcap("coarse.mcap"), "--level", "2"}).at("points").get<int>(),
            map.at("points").get<int>() / 4);
  RunOk({"pose", "export", "m", "--format", "mcap", "--out", mcap("poses.mcap")});
  EXPECT_EQ(TopicsOf(mcap("poses.mcap")), (std::map<std::string, int>{{drive, 1}, {"/tf", 8}}));
  RunOk({"plan", "m", "--from", "-4,0.5,0", "--to", "3,-0.5,0", "--out", mcap("path.mcap")});
  EXPECT_EQ(TopicsOf(mcap("path.mcap")), (std::map<std::string, int>{{"/path", 1}}));
}

TEST_F(StrataPlanTest, ProfilesKeepWhatIsNotGiven) {
  RunOk({"map", "create", "m", "--height", "1.7"});
  RunOk({"profile", "set", "m", "cart", "--radius", "0.5"});
  for (const json& profile : RunOk({"profile", "list", "m"})) {
    EXPECT_EQ(profile.at("height_m"), 1.7);
    EXPECT_EQ(profile.at("radius_m"), profile.at("name") == "cart" ? 0.5 : 0.3);
  }
}

}  // namespace
}  // namespace strata::cli
