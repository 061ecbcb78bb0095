// strata scan import and pose export, as their users run them.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/strata_fixture.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class StrataScanTest : public StrataTest {};

TEST_F(StrataScanTest, ImportWarnsWhenTheTrajectoryHasOtherScans) {
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

TEST_F(StrataScanTest, ImportSkipsWhatIsThereAndReportsABadFile) {
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

TEST_F(StrataScanTest, PosesComeBackByTimeAsTheyWereUploaded) {
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

}  // namespace
}  // namespace strata::cli
