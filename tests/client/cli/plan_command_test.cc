// What strata plan prints of a long plan.
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/commands_fixture.h"

namespace strata::cli {
namespace {

using ::testing::_;
using ::testing::HasSubstr;

class PlanCommandTest : public CommandsTest {};

TEST_F(PlanCommandTest, ALongPlanShowsTenWaypointsAndJsonAll) {
  PlanResult plan;
  plan.reason = PlanReason::kFound;
  for (int i = 0; i < 773; ++i) plan.waypoints.emplace_back(i, 0.5, 0.25);
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault([&](auto&, auto, auto&) {
    return absl::StatusOr<PlanResult>(plan);
  });
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto name) {
    return absl::StatusOr<MapInfo>(MapInfo{std::string(name), {}, {}});
  });
  const std::vector<std::string> words = {"plan", "m", "--from", "0,0", "--to", "772,0"};
  const auto rows = [&] {
    EXPECT_TRUE(Run(words, OutputFormat::kCsv).ok());
    return data_.str();
  };
  EXPECT_THAT(rows(), HasSubstr("x,y,z\n0,0.5,0.25\n1,0.5,0.25\n"));
  const std::string text = RunText(words);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 10 + 1) << text;
  EXPECT_THAT(text, HasSubstr("9.000  0.500  0.250\n  … 763 more; --out"));
  EXPECT_EQ(RunJson(words)["waypoints"].size(), 773U);
  EXPECT_EQ(talk_.str(), "");
  plan.reason = PlanReason::kBlocked;
  plan.obstruction = Obstruction::kUnknown;
  plan.obstruction_value = 0.401;
  RunText(words);
  EXPECT_THAT(talk_.str(), HasSubstr("at least --max-gap 0.41"));
  plan.obstruction_value = 0.2;  // less than this robot's
  RunText(words);
  EXPECT_EQ(talk_.str(), "");
}

}  // namespace
}  // namespace strata::cli
