// `strata scan import` of PTX and E57: what one file of all scans makes is what their files and
// poses make. The files are written by tests/support/write_survey.py, which shares nothing with
// what reads them.
#include <cstddef>
#include <cstdlib>
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
using ::testing::HasSubstr;

constexpr std::size_t kScans = 4;

class SurveyImportTest : public ImportOfOneFile {
 protected:
  SurveyImportTest() : ImportOfOneFile(kScans, 180) {}
  std::string Survey(const std::string& name) const {
    return Write(testing::SourcePath("tests/support/write_survey.py"), name);
  }
  // Makes a map of its own of what is said, aligned; the digest of its tiles and how many points
  // each scan has. Their hashes differ: files have times, too.
  std::string ContentOf(const std::string& map, const std::vector<std::string>& words) const {
    const Ran ran = Import(map, words);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    const json shown = json::parse(Run({"map", "show", map}).out);
    EXPECT_GT(shown.at("tiles"), 0);
    std::string content = shown.at("content_digest");
    const json scans = json::parse(Run({"scan", "list", map}).out);
    EXPECT_EQ(scans.size(), kScans);
    for (const json& scan : scans) content += scan.at("id").dump() + scan.at("points").dump();
    return content;
  }
};

TEST_F(SurveyImportTest, OneFileOfAllScansMakesTheMapThatTheirFilesMake) {
  const std::string content =
      ContentOf("files", {Path("robot/scans"), "--poses", Path("robot/poses_initial.txt")});
  for (const char* name : {"a.e57", "b.ptx"}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(ContentOf(std::string(1, name[0]), {Survey(name)}), content);
  }
}

TEST_F(SurveyImportTest, WhatIsThereIsNotSentTwice) {
  const std::string survey = Survey("a.e57");
  EXPECT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  EXPECT_EQ(json::parse(Run({"scan", "import", "m", survey}).out).at("uploaded"), kScans);
  const Ran again = Run({"scan", "import", "m", survey});
  EXPECT_EQ(json::parse(again.out).at("skipped"), kScans) << again.err;
  EXPECT_THAT(again.err, ::testing::Not(HasSubstr("has other scans")));
}

}  // namespace
}  // namespace strata::cli
