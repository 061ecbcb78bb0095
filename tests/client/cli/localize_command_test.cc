// strata localize, on a database that the test decides on.
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/commands_fixture.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;

class LocalizeCommandTest : public CommandsTest {};

TEST_F(LocalizeCommandTest, AScanIsSearchedForInTheFramesOfItsFile) {
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "scan.xyz").string();
  // Far coordinates, which the reader keeps apart from the points.
  std::ofstream(file) << "500000 0 0\n500001 0 0\n500000 1 0\n";
  LocalizeQuery seen;
  ON_CALL(db_.posegraph(), Localize(_, _, _))
      .WillByDefault([&seen](auto&, auto, const LocalizeQuery& query) {
        seen = query;
        LocalizeResult result;
        result.found = true;
        result.best.T_map_scan = *query.T_map_scan_guess;
        result.best.place = {"a", 1};
        result.message = "overlap 0.9";
        result.others.push_back(result.best);
        return absl::StatusOr<LocalizeResult>(result);
      });
  const std::vector<std::string> words = {
      "localize", "m", file, "--guess", "1,2,3,0.5rad", "--radius", "7"};
  const Json result = RunJson(words);
  EXPECT_EQ(seen.cloud.size(), 3U);
  EXPECT_TRUE(seen.cloud.origin.isZero());
  EXPECT_EQ(seen.guess_radius_m, 7.0);
  EXPECT_EQ(result["found"], true);
  EXPECT_EQ(result["place"], "a/1");
  // What came back was the guess, so it is the pose that was given.
  EXPECT_NEAR(result["pose"][0].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(result["pose"][1].get<double>(), 2.0, 1e-6);
  EXPECT_NEAR(result["others"][0]["pose"][2].get<double>(), 3.0, 1e-6);
  EXPECT_EQ(result["covariance"].size(), 6U);
  EXPECT_THAT(RunText(words), HasSubstr("found: overlap 0.9"));
}

TEST_F(LocalizeCommandTest, NowhereIsAnAnswer) {
  const ::strata::testing::TempDir dir;
  const std::string file = (dir.path() / "scan.xyz").string();
  std::ofstream(file) << "1 2 3\n4 5 6\n";
  LocalizeResult nowhere;
  nowhere.message = "best overlap 0.1";
  ON_CALL(db_.posegraph(), Localize(_, _, _)).WillByDefault(Return(nowhere));
  const Json result = RunJson({"localize", "m", file});
  EXPECT_EQ(result["found"], false);
  EXPECT_FALSE(result.contains("pose"));
  EXPECT_THAT(RunText({"localize", "m", file}), HasSubstr("not found: best overlap 0.1"));
}

}  // namespace
}  // namespace strata::cli
