// strata map, as its users run it.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/strata_fixture.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;

class StrataMapTest : public StrataTest {};

TEST_F(StrataMapTest, DiffTellsWhatCameWentAndMoved) {
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

TEST_F(StrataMapTest, BackupsAndMapsAreMergedIntoOne) {
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

TEST_F(StrataMapTest, AMapWithoutAnythingIsNotExported) {
  RunOk({"map", "create", "m"});
  for (const std::string format : {"ply", "glb", "mcap", "pcd", "geotiff"}) {
    const std::string file = (dir_.path() / ("empty." + format)).string();
    const Ran ran = Run({"map", "export", "m", "--format", format, "--out", file});
    EXPECT_EQ(ran.exit_code, 1) << format;
    EXPECT_THAT(ran.err, HasSubstr("import scans, or wait until they are integrated"));
    EXPECT_FALSE(std::filesystem::exists(file)) << format;
  }
}

TEST_F(StrataMapTest, OutputThatCannotBeWrittenIsAFailure) {
  WriteDrive(1);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const Ran ran = Run({"map", "export", "m", "--format", "ply", "--out", "/dev/full"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.out, "");
  EXPECT_THAT(ran.err, HasSubstr("/dev/full: cannot be written: No space left on device"));
}

TEST_F(StrataMapTest, APictureOfAnotherFormatIsRefused) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "render", "m", "/nonexistent/x.JPG"});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.err, HasSubstr("pictures are written as PNG"));
}

TEST_F(StrataMapTest, AProfileThatWouldChangeNothingOfAPictureIsRefused) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "render", "m", "/nonexistent/x.png", "--profile", "lifter"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, HasSubstr("--profile goes with --floor or --at"));
}

TEST_F(StrataMapTest, UnknownMapExitsWithOneAndKeepsStdoutEmpty) {
  RunOk({"map", "create", "m"});
  const Ran ran = Run({"map", "show", "nowhere"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.out, "");
  EXPECT_THAT(ran.err, HasSubstr("nowhere"));
}

TEST_F(StrataMapTest, OnlyMapCreateMakesTheDirectory) {
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

TEST_F(StrataMapTest, MapsThatCannotBeOpenedAreNamedAndNotDeleted) {
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

TEST_F(StrataMapTest, ADamagedTileIsNamedAndTheOthersAreDrawnAndExported) {
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

TEST_F(StrataMapTest, MapShowHasTheKeysThatScriptsRead) {
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
                          "surface_spread_m",
                          "content_digest"}) {
    EXPECT_TRUE(shown.contains(key)) << key;
  }
  EXPECT_EQ(shown.at("cell_size_m"), 0.2);
  EXPECT_EQ(RunOk({"map", "delete", "m"}).at("deleted"), "m");
  EXPECT_EQ(RunOk({"map", "list"}).size(), 0U);
}

TEST_F(StrataMapTest, VerifyAndRebuildKeepTheContent) {
  WriteDrive(2);
  RunOk({"map", "create", "m"});
  Import({"--align", "off"});
  const json before = RunOk({"map", "show", "m"});
  EXPECT_EQ(RunOk({"map", "verify", "m"}).at("state"), "succeeded");
  EXPECT_EQ(RunOk({"map", "rebuild", "m"}).at("state"), "succeeded");
  EXPECT_EQ(RunOk({"map", "show", "m"}).at("content_digest"), before.at("content_digest"));
  EXPECT_EQ(RunOk({"job", "list", "m"}).size(), 2U);
}

}  // namespace
}  // namespace strata::cli
