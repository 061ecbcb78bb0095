// Epochs, constraints and places over the wire, as a script would use them.
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/integration/cli/cli_fixture.h"

namespace strata::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// A pose as options take it.
std::string WithCommas(const json& pose) {
  return absl::StrJoin(pose.get<std::vector<double>>(), ",", [](std::string* out, double number) {
    absl::StrAppendFormat(out, "%.12f", number);
  });
}

class WorldTest : public CliTest {
 protected:
  // A robot's drive over the bridge in map "m", its poses taken as they are.
  void SetUp() override {
    StartServer();
    Json({"map", "create", "m"});
    RobotFiles files;
    files.step_m = 4.0;
    files.sensor.columns = 360;
    scans_ = WriteDrive("over", files);
    EXPECT_EQ(Json(ImportArguments("m", "over")).at("integrated"), scans_);
  }
  std::vector<json> Watched(std::vector<std::string> more) const {
    more.insert(more.begin(), {"map", "watch", "m", "--once"});
    const cli::Ran ran = Run(more);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    std::vector<json> updates;
    std::istringstream lines(ran.out);
    for (std::string line; std::getline(lines, line);) updates.push_back(json::parse(line));
    EXPECT_FALSE(updates.empty());
    return updates;
  }
  json PoseOf(const std::string& id) const { return Json({"pose", "lookup", "m", id}).at("pose"); }
  std::uint64_t Epoch() const { return Json({"map", "show", "m"}).at("epoch"); }
  // Says that over/1 is 0.3 m higher than it is, very surely; the id.
  std::string SayHigher() const {
    json pose = PoseOf("over/1");
    pose[2] = pose[2].get<double>() + 0.3;
    const std::string said = WithCommas(pose);
    const json added = Json({"posegraph",
                             "add-constraint",
                             "m",
                             "map",
                             "over/1",
                             "--pose",
                             said,
                             "--sigma-m",
                             "0.001",
                             "--sigma-rad",
                             "0.0001",
                             "--note",
                             "levelled"});
    EXPECT_EQ(added.at("origin"), "person");
    return std::to_string(added.at("id").get<std::uint64_t>());
  }
  static std::vector<std::string> Optimize(std::vector<std::string> more = {}) {
    more.insert(more.begin(),
                {"job", "start", "m", "optimize", "closures=0", "planes=0", "pool=1", "--wait"});
    return more;
  }

  std::uint64_t scans_ = 0;
};

TEST_F(WorldTest, AProposalIsAcceptedAndWatchersLearnWhereTheyWere) {
  const json before = Watched({}).back();
  const double z = PoseOf("over/1").at(2);
  SayHigher();
  const std::uint64_t epoch = Epoch();
  const json proposed = Json(Optimize({"--dry-run"}));
  EXPECT_EQ(proposed.at("state"), "proposed");
  EXPECT_EQ(Epoch(), epoch);
  EXPECT_NEAR(PoseOf("over/1").at(2).get<double>(), z, 1e-9);

  const std::string id = std::to_string(proposed.at("id").get<std::uint64_t>());
  EXPECT_EQ(Json({"job", "accept", "m", id, "--wait"}).at("state"), "succeeded");
  EXPECT_NEAR(PoseOf("over/1").at(2).get<double>(), z + 0.3, 0.01);
  bool told = false;
  for (const json& update :
       Watched({"--since", std::to_string(before.at("commit_sequence").get<std::uint64_t>())})) {
    for (const json& scan : update.at("scans")) {
      if (scan.at("id") != "over/1") continue;
      told = true;
      EXPECT_NEAR(scan.at("pose").at(2).get<double>(), z + 0.3, 0.01);
      EXPECT_GT(update.at("epoch").get<std::uint64_t>(), epoch);
    }
  }
  EXPECT_TRUE(told);

  const json history = Json({"map", "history", "m"});
  ASSERT_GE(history.size(), 2U);
  EXPECT_TRUE(history.at(0).at("current").get<bool>());
  EXPECT_EQ(history.at(0).at("job"), proposed.at("id"));
  const std::string first = std::to_string(history.back().at("epoch").get<std::uint64_t>());
  EXPECT_EQ(Json({"map", "revert", "m", first, "--wait"}).at("state"), "succeeded");
  EXPECT_NEAR(PoseOf("over/1").at(2).get<double>(), z, 1e-9);
  EXPECT_EQ(Json({"map", "verify", "m"}).at("state"), "succeeded");
}

TEST_F(WorldTest, AProposalIsForgottenAndAnEpochUndone) {
  const double z = PoseOf("over/1").at(2);
  SayHigher();
  const json proposed = Json(Optimize({"--dry-run"}));
  const std::string id = std::to_string(proposed.at("id").get<std::uint64_t>());
  EXPECT_EQ(Json({"job", "revert", "m", id, "--wait"}).at("state"), "cancelled");
  EXPECT_THAT(Run({"job", "accept", "m", id}).exit_code, 1);
  const json done = Json(Optimize());
  EXPECT_EQ(done.at("state"), "succeeded");
  EXPECT_NEAR(PoseOf("over/1").at(2).get<double>(), z + 0.3, 0.01);
  const std::string made = std::to_string(done.at("id").get<std::uint64_t>());
  EXPECT_EQ(Json({"job", "revert", "m", made, "--wait"}).at("state"), "succeeded");
  EXPECT_NEAR(PoseOf("over/1").at(2).get<double>(), z, 1e-9);
}

TEST_F(WorldTest, ConstraintsAreSeenSwitchedAndDrawn) {
  const std::string id = SayHigher();
  const json graph = Json({"posegraph", "show", "m", "--worst"});
  EXPECT_EQ(graph.at("scans"), scans_);
  EXPECT_EQ(graph.at("priors"), 1);
  EXPECT_EQ(graph.at("constraints").at(0).at("note"), "levelled");
  EXPECT_NEAR(graph.at("constraints").at(0).at("residual_m").get<double>(), 0.3, 1e-6);
  EXPECT_EQ(Json({"posegraph", "disable", "m", id}).at("enabled"), false);
  EXPECT_EQ(Json({"posegraph", "show", "m"}).at("disabled"), 1);
  EXPECT_TRUE(Json({"planes", "list", "m"}).is_array());
  const json drawn = Json({"map", "render", "m", Path("m.png"), "--trajectories", "--constraints"});
  EXPECT_GE(drawn.at("lines").get<int>(), 2);
  EXPECT_GT(std::filesystem::file_size(Path("m.png")), 1000U);
  EXPECT_EQ(Json({"posegraph", "enable", "m", id}).at("enabled"), true);
  Json({"posegraph", "remove-constraint", "m", id});
  const cli::Ran again = Run({"posegraph", "remove-constraint", "m", id});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr(id));
}

TEST_F(WorldTest, AScanIsFoundWhereItWasTaken) {
  Json({"scan", "export", "m", "over/3", "--format", "pcd", "--out", Path("scan.pcd")});
  const json pose = PoseOf("over/3");
  json near = pose;
  near[0] = pose[0].get<double>() + 0.4;
  near[1] = pose[1].get<double>() - 0.3;
  const std::string guess = WithCommas(near);
  const json found = Json({"localize", "m", Path("scan.pcd"), "--guess", guess, "--radius", "10"});
  ASSERT_TRUE(found.at("found").get<bool>()) << found;
  for (const std::size_t axis : {0U, 1U, 2U}) {
    EXPECT_NEAR(found.at("pose").at(axis).get<double>(), pose.at(axis).get<double>(), 0.1);
  }
  const json nowhere = Json({"localize", "m", Path("scan.pcd"), "--guess", "900,0,0"});
  EXPECT_FALSE(nowhere.at("found").get<bool>());
}

}  // namespace
}  // namespace strata::testing
