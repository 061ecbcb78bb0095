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
  const std::string text = RunText(words);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 10 + 1) << text;
  EXPECT_THAT(text, HasSubstr("9.000  0.500  0.250\n  … 763 more; --out"));
  EXPECT_EQ(RunJson(words)["waypoints"].size(), 773U);
}

}  // namespace
}  // namespace strata::cli
