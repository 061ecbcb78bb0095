// `strata scan import` and `scan topics` of recordings: what a bag of the same clouds and poses
// makes is what files make. The bags are written by tests/support/write_bag.py, which shares
// nothing with what reads them.
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/scan/import_of_one_file.h"
#include "tests/support/paths.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::size_t kScans = 6;

class BagImportTest : public ImportOfOneFile {
 protected:
  BagImportTest() : ImportOfOneFile(kScans, 360) {}
  // A bag of the robot's scans.
  std::string Bag(const std::string& name, const std::string& compression = "none") const {
    return Write(
        testing::SourcePath("tests/support/write_bag.py"), name, "--compression " + compression);
  }
  std::string Bytes(const std::string& path) const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // The digest of all tiles (their versions are commits, which differ) and, scan by scan, the hash
  // of the points, poses and times of a map; the points of one.
  std::string ContentOf(const std::string& map) const {
    const json shown = json::parse(Run({"map", "show", map}).out);
    EXPECT_GT(shown.at("tiles"), 0);
    std::string content = shown.at("content_digest");
    const json scans = json::parse(Run({"scan", "list", map}).out);
    EXPECT_EQ(scans.size(), kScans);
    for (const json& scan : scans) {
      for (const char* key : {"id", "time", "content_hash", "pose_uploaded", "pose"}) {
        content += scan.at(key).dump();
      }
    }
    const std::string last = scans.back().at("id");
    EXPECT_EQ(Run({"scan", "export", map, last, "--out", Path("scan.pcd")}).exit_code, 0);
    content += Bytes(Path("scan.pcd"));
    return content;
  }
};

TEST_F(BagImportTest, EveryBagMakesTheMapThatItsFilesMake) {
  const Ran files =
      Import("files", {Path("robot/scans"), "--poses", Path("robot/poses_initial.txt")});
  ASSERT_EQ(files.exit_code, 0) << files.err;
  const std::string content = ContentOf("files");
  struct Form {
    const char* name;
    const char* compression;
  };
  for (const auto& [name, compression] : {Form{"a.mcap", "none"},
                                          Form{"b.mcap", "lz4"},
                                          Form{"c.mcap", "zstd"},
                                          Form{"d.db3", "none"},
                                          Form{"f.bag", "bz2"},
                                          Form{"g.bag", "lz4"}}) {
    SCOPED_TRACE(absl::StrCat(name, " ", compression));
    const std::string bag = Bag(name, compression);
    // By a topic of poses, and by transforms.
    const std::string source = name[0] < 'c' ? "/odom" : "tf:odom->lidar";
    const std::string map = std::string(1, name[0]);
    const Ran ran =
        Import(map, {bag, "--topic", "/points", "--poses-from", source, "--every", "0m"});
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.err, HasSubstr("6 of 6 clouds of /points with poses from " + source));
    EXPECT_TRUE(ContentOf(map) == content);
  }
}

TEST_F(BagImportTest, KeyframesKeepTheirNumbersAndAreNotSentTwice) {
  const std::string bag = Bag("drive.mcap", "zstd");
  EXPECT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  const Ran first = Run({"scan", "import", "m", bag, "--every", "1.9m", "--wait"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const json summary = json::parse(first.out);
  EXPECT_EQ(summary.at("trajectory"), "drive");
  EXPECT_EQ(summary.at("uploaded"), 3);  // a metre from scan to scan
  const Ran all = Run({"scan", "import", "m", bag, "--every", "0m", "--wait"});
  EXPECT_EQ(json::parse(all.out).at("skipped"), 3) << all.err;
  EXPECT_EQ(json::parse(all.out).at("uploaded"), 3);
  EXPECT_THAT(all.err, Not(HasSubstr("has other scans")));
  const Ran spooled =
      Run({"scan", "import", "m", bag, "--trajectory", "again", "--spool", Path("spool")});
  EXPECT_EQ(spooled.exit_code, 0) << spooled.err;
  EXPECT_EQ(json::parse(spooled.out).at("sent"), 6) << spooled.out;
}

TEST_F(BagImportTest, TopicsAreListedForPeopleAndPrograms) {
  const std::string bag = Bag("drive.bag", "bz2");
  const Ran table = RunStrata({"scan", "topics", bag});
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out,
              AllOf(HasSubstr("TOPIC     TYPE                     MESSAGES   HZ  FRAMES"),
                    HasSubstr("/odom     nav_msgs/Odometry               6  1.0  odom -> lidar"),
                    HasSubstr("--topic"),
                    HasSubstr("transforms")));
  const json rows = json::parse(RunStrata({"scan", "topics", bag, "--output", "json"}).out);
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[2].at("topic"), "/points");
  EXPECT_EQ(rows[2].at("messages"), 6);
  EXPECT_EQ(rows[2].at("use"), "--topic");
  EXPECT_EQ(rows[2].at("hz"), 1.0);
  EXPECT_EQ(rows[3].at("frames"), "odom -> lidar");
}

TEST_F(BagImportTest, WhatMakesNoSenseIsRefusedWithTheCure) {
  const std::string bag = Bag("drive.mcap");
  EXPECT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  const auto refused = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"scan", "import", "m"});
    const Ran ran = Run(words);
    EXPECT_EQ(ran.exit_code, 1) << ran.out;
    return ran.err;
  };
  EXPECT_THAT(
      refused({bag, "--poses", Path("robot/poses_initial.txt")}),
      HasSubstr("--poses is for files of scans; of a recording say --topic and --poses-from"));
  EXPECT_THAT(refused({Path("robot"), "--every", "1m"}),
              AllOf(HasSubstr("--every is for recordings"), HasSubstr("is none")));
  EXPECT_THAT(refused({bag, "--every", "fast"}), HasSubstr("0.5m, 20deg, 2s"));
  EXPECT_THAT(refused({bag, "--topic", "/cloud"}), HasSubstr("say --topic /points ("));
  EXPECT_THAT(refused({bag, "--poses-from", "tf:odom"}),
              HasSubstr("--poses-from tf:FIXED->BASE with two of the frames lidar, odom"));
  EXPECT_THAT(refused({bag, "--poses-from", "tf:map->lidar"}),
              HasSubstr("no transforms lead from map"));
  std::ofstream(Path("empty.mcap")) << "";
  EXPECT_THAT(refused({Path("empty.mcap")}), HasSubstr("no bag by its first bytes"));
  EXPECT_EQ(json::parse(Run({"scan", "list", "m"}).out).size(), 0U);
}

TEST_F(BagImportTest, ABagThatEndsTooEarlyGivesWhatItHas) {
  const std::string bag = Bag("drive.mcap");
  std::filesystem::resize_file(bag, std::filesystem::file_size(bag) * 6 / 10);
  const Ran ran = Import("m", {bag, "--every", "0m"});
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr(absl::StrCat("ends at byte ", std::filesystem::file_size(bag))));
  const json summary = json::parse(ran.out);
  EXPECT_GE(summary.at("uploaded"), 2);
  EXPECT_LT(summary.at("uploaded"), 6);
}

}  // namespace
}  // namespace strata::cli
