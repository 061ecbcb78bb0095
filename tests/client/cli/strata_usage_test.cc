// Help, wrong usage and global options of the program.
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/client/cli/strata_fixture.h"

namespace strata::cli {
namespace {

using ::testing::HasSubstr;

class StrataUsageTest : public StrataTest {};

TEST_F(StrataUsageTest, EveryCommandHasHelpWithAnExample) {
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
                                             "explore",
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
                                             "map places",
                                             "map mesh",
                                             "path check",
                                             "path watch",
                                             "pose lookup",
                                             "localize",
                                             "planes list",
                                             "objects find",
                                             "objects list",
                                             "objects show",
                                             "objects export",
                                             "objects complete",
                                             "kind list",
                                             "kind rename",
                                             "kind export",
                                             "kind import",
                                             "kind delete",
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

TEST_F(StrataUsageTest, TheHelpOfJobsHasTheirKindsAndParameters) {
  const std::string help = RunStrata({"job", "start", "--help"}).out;
  EXPECT_THAT(help, HasSubstr("\nfade      Points through whose place"));
  EXPECT_THAT(help, HasSubstr("\n  rounds=1..50          Most rounds"));
}

TEST_F(StrataUsageTest, WrongUsageExitsWithTwo) {
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

TEST_F(StrataUsageTest, NounsAndTheProgramHaveHelpWithAnExample) {
  for (const std::string noun : {"map",
                                 "scan",
                                 "pose",
                                 "tile",
                                 "profile",
                                 "job",
                                 "posegraph",
                                 "planes",
                                 "objects",
                                 "kind",
                                 "path"}) {
    EXPECT_THAT(RunStrata({noun, "--help"}).out, HasSubstr("Example:\n  strata " + noun));
  }
  EXPECT_THAT(RunStrata({"--help"}).out,
              HasSubstr("Example:\n  strata --embedded maps map create"));
}

TEST_F(StrataUsageTest, AWrongWordIsAnsweredWithTheNearestRightOne) {
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

TEST_F(StrataUsageTest, GlobalOptionsWorkBeforeAndAfterTheVerb) {
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

}  // namespace
}  // namespace strata::cli
