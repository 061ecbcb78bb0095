// What `strata scan import` refuses and says before a map is garbage.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/support/data_dir.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ImportTruthTest : public ::testing::Test {
 protected:
  void SetUp() override { EXPECT_EQ(Run({"map", "create", "m"}).exit_code, 0); }
  Ran Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(arguments);
  }
  Ran Import(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words = {"scan", "import", "m"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return Run(words);
  }
  std::size_t ScansInMap() const {
    return json::parse(Run({"scan", "list", "m"}).out, nullptr, false).size();
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories((dir_.path() / name).parent_path());
    std::ofstream(dir_.path() / name, std::ios::binary) << bytes;
    return Path(name);
  }
  // A floor of 100 points around (x, y), 1 m below the sensor.
  static std::string Floor(double x, double y) {
    std::string text;
    for (int i = 0; i < 100; ++i) {
      text += std::to_string(x + i % 10) + " " + std::to_string(y + i / 10 + 0.5) + " -1\n";
    }
    return text;
  }

  testing::TempDir dir_;
};

TEST_F(ImportTruthTest, SeveralScansWithoutPosesAreRefused) {
  Write("set/scans/s1.xyz", Floor(0, 0));
  Write("set/scans/s2.xyz", Floor(0, 0));
  const Ran refused = Import({Path("set/scans"), "--wait"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("2 scans and no poses"), HasSubstr("--poses none")));
  EXPECT_EQ(Run({"scan", "import", "m", Path("set"), "--spool", Path("spool")}).exit_code, 1);
  EXPECT_EQ(ScansInMap(), 0U);
  EXPECT_EQ(Import({Path("set/scans/s1.xyz"), "--trajectory", "one"}).exit_code, 0);
  EXPECT_EQ(Import({Path("set/scans"), "--poses", "none"}).exit_code, 0);
  EXPECT_EQ(ScansInMap(), 3U);
}

TEST_F(ImportTruthTest, AFolderOfScansAndPosesIsUnderstood) {
  Write("set/scans/s1.xyz", Floor(0, 0));
  Write("set/scans/s2.xyz", Floor(0, 0));
  const std::string poses = Write("set/poses.txt", "1 5 0 0 0 0 0 0 1\n2 6 7 0 0 0 0 0 1\n");
  const Ran done = Import({Path("set"), "--wait"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("poses of " + poses));
  EXPECT_EQ(json::parse(done.out).at("trajectory"), "set");
  const json scan = json::parse(Run({"scan", "show", "m", "set/2"}).out);
  EXPECT_EQ(scan.at("pose_uploaded").at(0), 7.0);
  const std::string other = Write("set/poses_b.txt", "1 5 0 0 0 0 0 0 1\n");
  const Ran unclear = Import({Path("set")});
  EXPECT_EQ(unclear.exit_code, 1);
  EXPECT_THAT(unclear.err, AllOf(HasSubstr(poses), HasSubstr(other), HasSubstr("--poses FILE")));
}

TEST_F(ImportTruthTest, ScansFarFromTheMapAreRefusedBeforeAnythingIsSent) {
  Write("near/s1.xyz", Floor(0, 0));
  Write("near/s2.xyz", Floor(0, 0));
  // A drive of 18 km is no jump; the third scan is none of its places.
  Write("drive/s1.xyz", Floor(0, 0));
  Write("drive/s2.xyz", Floor(0, 0));
  Write("drive/s3.xyz", Floor(0, 0));
  const std::string drive =
      Write("drive/poses.txt", "1 0 0 0 0 0 0 0 1\n2 1 9000 0 0 0 0 0 1\n3 2 18000 0 0 0 0 0 1\n");
  const std::string jump =
      Write("jump.txt", "1 0 0 0 0 0 0 0 1\n2 1 1 0 0 0 0 0 1\n3 2 18000 0 0 0 0 0 1\n");
  const Ran refused = Import({Path("drive"), "--poses", jump});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr("s3.xyz"),
                    HasSubstr("18.0 km"),
                    HasSubstr("--far"),
                    HasSubstr("nothing was uploaded")));
  EXPECT_EQ(ScansInMap(), 0U);
  EXPECT_EQ(Import({Path("drive"), "--poses", drive, "--wait"}).exit_code, 0);
  EXPECT_EQ(ScansInMap(), 3U);
  // The points are far, not the pose: a survey's coordinates.
  const std::string utm = Write("utm/u1.xyz", Floor(494'500, 4'878'100));
  const Ran survey = Import({utm});
  EXPECT_EQ(survey.exit_code, 1);
  EXPECT_THAT(survey.err, AllOf(HasSubstr("km from"), HasSubstr("UTM")));
  EXPECT_EQ(ScansInMap(), 3U);
  EXPECT_EQ(Import({utm, "--far"}).exit_code, 0);
  EXPECT_EQ(Run({"map", "create", "geo"}).exit_code, 0);
  Write("utm/u2.xyz", Floor(494'510, 4'878'100));
  EXPECT_EQ(Run({"scan", "import", "geo", Path("utm"), "--poses", "none"}).exit_code, 0);
  const std::string text = Write("text/u3.txt", Floor(494'500, 4'878'100));
  EXPECT_EQ(Run({"map", "create", "text"}).exit_code, 0);
  EXPECT_EQ(Run({"scan", "import", "text", text, "--format", "xyz"}).exit_code, 0);
}

TEST_F(ImportTruthTest, ReturnsOfRangeZeroAreCountedAndNoSurface) {
  const std::string file = Write("s1.xyz", "0 0 0\n0 0 0\n" + Floor(2, 2) + "0 0 0\n");
  const Ran done = Import({file, "--wait"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const json summary = json::parse(done.out);
  EXPECT_EQ(summary.at("range_0"), 3);
  EXPECT_EQ(summary.at("points"), 100);
  const json at = json::parse(Run({"surface", "m", "--at", "0,0"}).out);
  EXPECT_EQ(at.at("surfaces").size(), 0U);
}

TEST_F(ImportTruthTest, WhatIsThereAlreadyIsSaidAndATimeThatIsNoneIsNotOf1970) {
  const std::string file = Write("s1.xyz", Floor(0, 0));
  EXPECT_EQ(Import({file, "--trajectory", "t", "--wait"}).exit_code, 0);
  const Ran again = RunStrata(
      {"scan", "import", "m", file, "--trajectory", "t", "--wait", "--embedded", Path("db")});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("already there  1\n"));
  EXPECT_THAT(again.out, ::testing::Not(HasSubstr("aligned")));
  EXPECT_TRUE(json::parse(Run({"scan", "show", "m", "t/1"}).out).at("time").is_null());
  const Ran listed = RunStrata({"scan", "list", "m", "--embedded", Path("db")});
  EXPECT_THAT(listed.out, ::testing::Not(HasSubstr("1970")));
}

// Lines of poses whose numbers and times stay and whose places come in reverse.
std::string Reversed(const std::filesystem::path& poses) {
  std::ifstream file(poses);
  std::vector<std::pair<std::string, std::string>> lines;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t end = line.find(' ', line.find(' ') + 1);
    lines.emplace_back(line.substr(0, end), line.substr(end));
  }
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += lines[i].first + lines[lines.size() - 1 - i].second + "\n";
  }
  return text;
}

TEST_F(ImportTruthTest, PosesOfOtherScansAreDoubtedAndTheirOwnAreNot) {
  STRATA_REQUIRE_DATA(data, "");
  constexpr std::size_t kUsed = 12;  // of the scans, whose poses are metres apart
  const std::filesystem::path scans = Path("scans");
  std::filesystem::create_directory(scans);
  std::set<std::filesystem::path> files;
  for (const auto& file : std::filesystem::directory_iterator(data / "hall_livox_loop/scans")) {
    files.insert(file.path());
  }
  ASSERT_GE(files.size(), kUsed);
  for (auto file = files.begin(); file != std::next(files.begin(), kUsed); ++file) {
    std::filesystem::create_symlink(*file, scans / file->filename());
  }
  const auto import = [&](const std::string& trajectory, const std::string& poses) {
    return Import({scans.string(),
                   "--poses",
                   poses,
                   "--pose-format",
                   "index-tum",
                   "--trajectory",
                   trajectory,
                   "--wait"});
  };
  const std::filesystem::path own = data / "hall_livox_loop/poses_reference.txt";
  const Ran others = import("others", Write("reversed.txt", Reversed(own)));
  EXPECT_TRUE(json::parse(others.out).at("poses_doubtful").get<bool>()) << others.out;
  EXPECT_THAT(others.err, HasSubstr("the poses are probably those of other scans"));
  EXPECT_EQ(Run({"map", "delete", "m"}).exit_code, 0);
  EXPECT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  const Ran right = import("own", own.string());
  const json summary = json::parse(right.out);
  EXPECT_FALSE(summary.at("poses_doubtful").get<bool>()) << right.out;
  EXPECT_GT(summary.at("median_overlap").get<double>(), 0.9);
  EXPECT_THAT(right.err, ::testing::Not(HasSubstr("warning")));
}

TEST_F(ImportTruthTest, RecordedSetsWithPosesAreUnderstood) {
  STRATA_REQUIRE_DATA(data, "");
  const auto refused = [&](const std::string& set) {
    const Ran ran = Import({(data / set).string(), "--trajectory", "t"});
    EXPECT_EQ(ran.exit_code, 1) << set << ran.err;
    return ran.err;
  };
  const Ran drive = Import({(data / "slam6d_corridor").string(), "--trajectory", "corridor"});
  EXPECT_EQ(drive.exit_code, 0) << drive.err;
  for (const std::string set : {"hall_livox_loop", "eth_facade_tls", "nclt_campus_loop"}) {
    EXPECT_THAT(refused(set), AllOf(HasSubstr("several files of poses"), HasSubstr(set)));
  }
  EXPECT_THAT(refused("hall_livox_loop/scans"),
              AllOf(HasSubstr("30 scans and no poses"), HasSubstr("poses_initial.txt")));
  EXPECT_THAT(refused("kitti00_gt"), HasSubstr("poses_00_velo.txt"));
  EXPECT_THAT(refused("nclt_keyframes"), HasSubstr("no poses"));
  EXPECT_EQ(ScansInMap(), 3U);
}

}  // namespace
}  // namespace strata::cli
