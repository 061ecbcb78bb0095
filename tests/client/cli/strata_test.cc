// The program as its users have it, on a database in a temporary directory.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "client/formats/geometry_writer.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator.h"
#include "tests/support/temp_dir.h"
#include "tests/support/worlds.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class StrataTest : public ::testing::Test {
 protected:
  // `arguments` on the embedded database with JSON output.
  Ran Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--embedded", database_, "--output", "json"});
    return RunStrata(arguments);
  }
  json RunOk(const std::vector<std::string>& arguments) const {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  std::string Write(const std::string& name, const std::string& bytes) const {
    const std::filesystem::path path = dir_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
    return path.string();
  }
  static std::string Contents(const std::string& file) {
    std::ostringstream contents;
    contents << std::ifstream(file, std::ios::binary).rdbuf();
    return contents.str();
  }
  // A drive over a floor between walls as scans/scan0.pcd … and poses.txt (index-tum, exact).
  void WriteDrive(int scans) {
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
  json Import(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {
        "scan", "import", "m", scans_, "--poses", poses_, "--trajectory", "t", "--wait"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunOk(arguments);
  }

  testing::TempDir dir_;
  std::string database_ = (dir_.path() / "db").string();
  std::string scans_;
  std::string poses_;
};

TEST_F(StrataTest, EveryCommandHasHelpWithAnExample) {
  const std::vector<std::string> commands = {"map create",
                                             "map list",
                                             "map show",
                                             "map delete",
                                             "map verify",
                                             "map rebuild",
                                             "map export",
                                             "map render",
                                             "scan import",
                                             "scan list",
                                             "scan show",
                                             "scan export",
                                             "scan mesh",
                                             "scan heights",
                                             "scan delete",
                                             "pose list",
                                             "pose export",
                                             "pose set",
                                             "tile list",
                                             "tile get",
                                             "surface",
                                             "plan",
                                             "profile set",
                                             "profile list",
                                             "job start",
                                             "job list",
                                             "job show",
                                             "job watch",
                                             "job cancel",
                                             "job accept",
                                             "job revert",
                                             "map history",
                                             "map revert",
                                             "map watch",
                                             "map diff",
                                             "map backup",
                                             "map merge",
                                             "map mesh",
                                             "path check",
                                             "path watch",
                                             "pose lookup",
                                             "localize",
                                             "planes list",
                                             "posegraph show",
                                             "posegraph add-constraint",
                                             "posegraph remove-constraint",
                                             "posegraph enable",
                                             "posegraph disable"};
  for (const std::string& command : commands) {
    std::vector<std::string> words;
    std::istringstream stream(command);
    for (std::string word; stream >> word;) {
      words.push_back(word);
    }
    words.emplace_back("--help");
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 0) << command;
    EXPECT_THAT(ran.out, HasSubstr("Example:\n  strata " + command));
  }
}

TEST_F(StrataTest, TheHelpOfJobsHasTheirKindsAndParameters) {
  const std::string help = RunStrata({"job", "start", "--help"}).out;
  EXPECT_THAT(help, HasSubstr("\nfade      Points through whose place"));
  EXPECT_THAT(help, HasSubstr("\n  rounds=1..50          Most rounds"));
}

TEST_F(StrataTest, WrongUsageExitsWithTwo) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"fly"},
      {"map"},
      {"map", "create"},
      {"plan", "m"},
      {"plan", "m", "--from", "1,2,3"},
      {"plan", "m", "--from", "1,x", "--to", "1,2"},
      {"plan", "m", "--from", "1,2", "--to", "1,2", "--max-expanded", "-1"},
      {"job", "show", "m", "-1"},
      {"job", "start", "m", "optimize", "fast"},
      {"map", "revert", "m", "first"},
      {"localize", "m", "scan.pcd", "--guess", "1,2"},
      {"posegraph", "disable", "m", "0"},
      {"posegraph", "add-constraint", "m", "a/1", "b", "--pose", "1,2,3"},
      {"scan", "list", "m", "--box", "1,0,-1,2"},
      {"tile", "list", "m", "--area", "0,1,2,0"},
      {"surface", "m"},
      {"map", "list", "--output", "yaml"},
      {"scan", "show", "m", "no-number"}};
  for (const auto& words : wrong) {
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 2) << ran.err;
    EXPECT_EQ(ran.out, "");
  }
}

TEST_F(StrataTest, NounsAndTheProgramHaveHelpWithAnExample) {
  for (const std::string noun :
       {"map", "scan", "pose", "tile", "profile", "job", "posegraph", "planes", "path"}) {
    EXPECT_THAT(RunStrata({noun, "--help"}).out, HasSubstr("Example:\n  strata " + noun));
  }
  EXPECT_THAT(RunStrata({"--help"}).out,
              HasSubstr("Example:\n  strata --embedded maps map create"));
}

TEST_F(StrataTest, AWrongWordIsAnsweredWithTheNearestRightOne) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"map", "creat", "x"}, "did you mean create?"},
      {{"plan", "m", "--form", "1,2,3", "--to", "1,2,3"}, "did you mean --from?"},
      {{"scan", "import", "m", "x", "--pose", "p"}, "did you mean --poses?"},
      {{"surface", "m", "--point", "p"}, "did you mean --points?"},
      {{"--serv", "x:1", "map", "list"}, "did you mean --server?"},
      {{"map", "list", "--server", "127.0.0.1"}, "expected HOST:PORT"},
      {{"map", "list", "--server", "127.0.0.1:99999"}, "expected HOST:PORT"}};
  for (const auto& [words, message] : wrong) {
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 2) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_THAT(ran.err, HasSubstr(message));
  }
}

TEST_F(StrataTest, DiffTellsWhatCameWentAndMoved) {
  WriteDrive(3);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const json same = RunOk({"map", "diff", "m", "m"});
  EXPECT_EQ(same["tiles_compared"], 0);
  const std::string scan = "t/0";
  RunOk({"pose", "set", "m", scan, "--pose", "-4,0,1.3,0,0,0,1"});
  const std::string picture = (dir_.path() / "diff.png").string();
  const json diff = RunOk({"map", "diff", "m@1", "m", "--out", picture});
  EXPECT_GT(diff["moved"], 100);
  EXPECT_GT(diff["unchanged"], 100);
  EXPECT_GT(diff["rise_largest_m"].get<double>(), 0.25);
  EXPECT_TRUE(std::filesystem::file_size(picture) > 1000);
  // The way back is the opposite, and tiles as they are now are not fetched without a picture.
  const json back = RunOk({"map", "diff", "m", "m@1"});
  EXPECT_EQ(back["added"], diff["removed"]);
  EXPECT_EQ(back["removed"], diff["added"]);
  EXPECT_EQ(back["moved"], diff["moved"]);
  EXPECT_NEAR(back["rise_rms_m"].get<double>(), diff["rise_rms_m"].get<double>(), 1e-9);
  RunOk({"pose", "set", "m", scan, "--pose", "-4,0,1,0,0,0,1"});
  const json undone = RunOk({"map", "diff", "m@1", "m"});
  EXPECT_EQ(undone["added"], 0);
  EXPECT_EQ(undone["removed"], 0);
  EXPECT_EQ(undone["moved"], 0);
  RunOk({"map", "create", "coarse", "--cell-size", "0.2"});
  const Ran refused = Run({"map", "diff", "m", "coarse"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("different cells or gaps"));
  EXPECT_THAT(Run({"map", "diff", "m@99", "m"}).err, HasSubstr("map history"));
  EXPECT_EQ(Run({"map", "diff", "m@x", "m"}).exit_code, 2);
}

TEST_F(StrataTest, BackupsAndMapsAreMergedIntoOne) {
  WriteDrive(3);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const std::string file = (dir_.path() / "m copy.strata").string();
  const mode_t before = ::umask(0);
  const json written = RunOk({"map", "backup", "m", file});
  ::umask(before);
  EXPECT_EQ(std::filesystem::status(file).permissions() & std::filesystem::perms::others_all,
            std::filesystem::perms::none);
  EXPECT_EQ(std::filesystem::file_size(file), written["bytes"]);
  EXPECT_EQ(written["content_hash"].get<std::string>().size(), 32U);
  const Ran again = Run({"map", "backup", "m", file});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("exists; --force"));
  RunOk({"map", "backup", "m", file, "--force"});
  EXPECT_EQ(Run({"map", "backup", "none", file, "--force"}).exit_code, 1);
  EXPECT_EQ(std::filesystem::file_size(file), written["bytes"]);  // as before

  // Other scans of the same drive, one of them moved; all of it once more in one map.
  RunOk({"map", "create", "n"});
  const auto import = [&](const std::string& map, const std::string& trajectory) {
    RunOk({"scan",
           "import",
           map,
           scans_,
           "--poses",
           poses_,
           "--trajectory",
           trajectory,
           "--align",
           "off",
           "--wait"});
  };
  import("n", "u");
  const std::vector<std::string> move = {"pose", "set", "n", "u/1", "--pose", "1,2,1,0,0,0,1"};
  RunOk(move);
  RunOk({"map", "create", "both"});
  import("both", "t");
  import("both", "u");
  RunOk({"pose", "set", "both", "u/1", "--pose", "1,2,1,0,0,0,1"});
  const json merged = RunOk({"map", "merge", "all", file, "n"});
  const json expected = RunOk({"map", "show", "both"});
  EXPECT_EQ(merged["content_digest"], expected["content_digest"]);
  EXPECT_EQ(merged["scans"], 6);
  RunOk({"map", "verify", "all"});

  const Ran clash = Run({"map", "merge", "twice", "m", file});
  EXPECT_EQ(clash.exit_code, 1);
  EXPECT_THAT(clash.err, HasSubstr("trajectory t is in m and in"));
  EXPECT_THAT(clash.err, HasSubstr("--rename-clashes"));
  EXPECT_EQ(Run({"map", "show", "twice"}).exit_code, 1);
  RunOk({"map", "create", "coarse", "--cell-size", "0.2"});
  EXPECT_THAT(Run({"map", "merge", "x", "m", "coarse"}).err, HasSubstr("differ in cell size"));
  EXPECT_THAT(Run({"map", "merge", "all", "m"}).err, HasSubstr("all exists"));
}

TEST_F(StrataTest, PathsAreCheckedFromTheirFiles) {
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

TEST_F(StrataTest, OutputThatCannotBeWrittenIsAFailure) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "export", "m", "--format", "ply", "--out", "/dev/full"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.out, "");
  EXPECT_THAT(ran.err, HasSubstr("/dev/full: cannot be written: No space left on device"));
}

TEST_F(StrataTest, APictureOfAnotherFormatIsRefused) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "render", "m", "/nonexistent/x.JPG"});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.err, HasSubstr("pictures are written as PNG"));
}

TEST_F(StrataTest, UnknownMapExitsWithOneAndKeepsStdoutEmpty) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "show", "nowhere"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.out, "");
  EXPECT_THAT(ran.err, HasSubstr("nowhere"));
}

TEST_F(StrataTest, OnlyMapCreateMakesTheDirectory) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"map", "list"},
                                                {"map", "show", "m"},
                                                {"map", "delete", "m"},
                                                {"scan", "list", "m"}}) {
    const Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_EQ(ran.out, "");
    EXPECT_THAT(ran.err, HasSubstr("directory " + database_ + " does not exist; map create"));
    EXPECT_FALSE(std::filesystem::exists(database_));
  }
  RunOk({"map", "create", "m"});
  EXPECT_EQ(RunOk({"map", "list"}).size(), 1U);
}

TEST_F(StrataTest, MapsThatCannotBeOpenedAreNamedAndNotDeleted) {
  RunOk({"map", "create", "m"});
  const std::string file = Write("db/notes.strata", "my notes");
  const Ran ran = Run({"map", "list"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_EQ(json::parse(ran.out).size(), 1U);
  EXPECT_THAT(ran.err, HasSubstr("map=notes not_opened=\"notes.strata: "));
  const Ran deleted = Run({"map", "delete", "notes"});
  EXPECT_EQ(deleted.exit_code, 1);
  EXPECT_THAT(deleted.err, HasSubstr("notes.strata is not a Strata map but no database file"));
  EXPECT_EQ(Contents(file), "my notes");
}

TEST_F(StrataTest, ADamagedTileIsNamedAndTheOthersAreDrawnAndExported) {
  WriteDrive(3);
  RunOk({"map", "create", "m", "--cell-size", "0.05"});
  Import({"--align", "off"});
  const std::size_t tiles = RunOk({"tile", "list", "m"}).size();
  ASSERT_GT(tiles, 2U);
  const std::string served = (dir_.path() / "tile").string();
  RunOk({"tile", "get", "m", "0/0/0", "--out", served});
  const std::string map_file = database_ + "/m.strata";
  std::string bytes = Contents(map_file);
  const std::size_t at = bytes.find(Contents(served).substr(0, 64));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 60] ^= 1;
  Write("db/m.strata", bytes);

  const std::string png = (dir_.path() / "map.png").string();
  const std::string ply = (dir_.path() / "map.ply").string();
  const std::string sentence =
      "error: 1 tile is damaged and left out: 0/0/0; map rebuild m mends it";
  const Ran drawn = Run({"map", "render", "m", png, "--level", "0"});
  EXPECT_EQ(drawn.exit_code, 1);
  EXPECT_THAT(drawn.err, HasSubstr(sentence));
  EXPECT_EQ(json::parse(drawn.out).at("tiles"), tiles - 1);
  EXPECT_GT(std::filesystem::file_size(png), 5000U);
  const std::vector<std::string> mesh = {"map", "export", "m", "--format", "ply", "--out", ply};
  const Ran written = Run(mesh);
  EXPECT_EQ(written.exit_code, 1);
  EXPECT_THAT(written.err, HasSubstr(sentence));
  const auto vertices = json::parse(written.out).at("vertices").get<std::size_t>();
  EXPECT_GT(vertices, 1000U);
  RunOk({"map", "rebuild", "m"});
  EXPECT_GT(RunOk(mesh).at("vertices").get<std::size_t>(), vertices);
}

TEST_F(StrataTest, ImportWarnsWhenTheTrajectoryHasOtherScans) {
  WriteDrive(2);
  RunOk({"map", "create", "m"});
  const auto import = [&](const std::string& run, bool poses) {
    std::filesystem::create_directories(dir_.path() / run / "walk");
    std::filesystem::copy(scans_,
                          dir_.path() / run / "walk",
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
    std::vector<std::string> words = {
        "scan", "import", "m", (dir_.path() / run / "walk").string(), "--align", "off"};
    words.insert(words.end(), {"--poses", poses ? poses_ : "none"});
    const Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.err;
  };
  const auto warned = HasSubstr("warning: trajectory walk has other scans under these numbers (");
  EXPECT_THAT(import("monday", false), Not(warned));
  EXPECT_THAT(import("monday", false), Not(warned));
  EXPECT_THAT(import("tuesday", true), warned);
  Write("scans/scan0.pcd", Contents(scans_ + "/scan1.pcd"));
  EXPECT_THAT(import("wednesday", false), warned);
}

TEST_F(StrataTest, GlobalOptionsWorkBeforeAndAfterTheVerb) {
  RunOk({"map", "create", "m"});
  const std::vector<std::string> global = {"--embedded", database_, "--output", "json"};
  for (int position = 0; position <= 2; ++position) {
    std::vector<std::string> words = {"map", "list"};
    words.insert(words.begin() + position, global.begin(), global.end());
    const Ran ran = RunStrata(words);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(json::parse(ran.out).at(0).at("name"), "m");
  }
}

TEST_F(StrataTest, MapShowHasTheKeysThatScriptsRead) {
  RunOk({"map", "create", "m", "--cell-size", "0.2", "--gap-size", "0.8"});
  const json shown = RunOk({"map", "show", "m"});
  for (const char* key : {"scans",
                          "points",
                          "patches",
                          "occupied_cells",
                          "tiles",
                          "tiles_prepared",
                          "tile_bytes",
                          "point_bytes",
                          "epoch",
                          "content_digest"}) {
    EXPECT_TRUE(shown.contains(key)) << key;
  }
  EXPECT_EQ(shown.at("cell_size_m"), 0.2);
  EXPECT_EQ(RunOk({"map", "delete", "m"}).at("deleted"), "m");
  EXPECT_EQ(RunOk({"map", "list"}).size(), 0U);
}

TEST_F(StrataTest, ImportSkipsWhatIsThereAndReportsABadFile) {
  WriteDrive(3);
  RunOk({"map", "create", "m"});
  const json first = Import({"--align", "off"});
  EXPECT_EQ(first.at("uploaded"), 3);
  EXPECT_EQ(first.at("integrated"), 3);
  const json second = Import({"--align", "off"});
  EXPECT_EQ(second.at("uploaded"), 0);
  EXPECT_EQ(second.at("skipped"), 3);
  const std::string bad = Write("scans/scan2.pcd", "# .PCD v0.7\nFIELDS x y z\nnonsense\n");
  const Ran ran =
      Run({"scan", "import", "m", scans_, "--poses", poses_, "--trajectory", "u", "--wait"});
  EXPECT_EQ(ran.exit_code, 1);
  const json third = json::parse(ran.out);
  EXPECT_EQ(third.at("uploaded"), 2);
  EXPECT_EQ(third.at("failed"), 1);
  EXPECT_EQ(third.at("errors").at(0).at("scan"), bad);
  EXPECT_EQ(third.at("errors").at(0).at("error"),
            "line 3: expected a PCD header entry, found 'nonsense'");
  EXPECT_THAT(ran.err, HasSubstr("error: " + bad + ": line 3: expected"));
}

TEST_F(StrataTest, PosesComeBackByTimeAsTheyWereUploaded) {
  WriteDrive(3);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const std::string file = (dir_.path() / "tum.txt").string();
  RunOk({"pose", "export", "m", "--format", "tum", "--which", "uploaded", "--out", file});
  std::ifstream poses(file);
  for (int i = 0; i < 3; ++i) {
    double time = 0;
    double x = 0;
    std::string line;
    ASSERT_TRUE(std::getline(poses, line));
    std::istringstream(line) >> time >> x;
    EXPECT_NEAR(time, 100.25 + i, 1e-6);
    EXPECT_NEAR(x, -4.0 + i, 1e-9);
  }
}

TEST_F(StrataTest, SurfacePlanRenderAndExportOfADrive) {
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

TEST_F(StrataTest, VerifyAndRebuildKeepTheContent) {
  WriteDrive(2);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const json before = RunOk({"map", "show", "m"});
  EXPECT_EQ(RunOk({"map", "verify", "m"}).at("state"), "succeeded");
  EXPECT_EQ(RunOk({"map", "rebuild", "m"}).at("state"), "succeeded");
  EXPECT_EQ(RunOk({"map", "show", "m"}).at("content_digest"), before.at("content_digest"));
  EXPECT_EQ(RunOk({"job", "list", "m"}).size(), 2U);
}

TEST_F(StrataTest, ProfilesKeepWhatIsNotGiven) {
  RunOk({"map", "create", "m", "--height", "1.7"});
  RunOk({"profile", "set", "m", "cart", "--radius", "0.5"});
  for (const json& profile : RunOk({"profile", "list", "m"})) {
    EXPECT_EQ(profile.at("height_m"), 1.7);
    EXPECT_EQ(profile.at("radius_m"), profile.at("name") == "cart" ? 0.5 : 0.3);
  }
}

}  // namespace
}  // namespace strata::cli
