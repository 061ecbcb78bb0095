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
using ::testing::ElementsAre;
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

TEST_F(PlanCommandTest, WhatWasInferredIsAnObstacleToEverythingThatIsAskedOfTheWay) {
  std::vector<InferredAs> asked;
  PlanResult plan;
  plan.waypoints = {{0, 0, 0}, {1, 0, 0}};
  ON_CALL(db_.planning(), ListProfiles(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<std::map<std::string, RobotProfile>>({{"default", RobotProfile()}});
  });
  ON_CALL(db_.planning(), PlanPath(_, _, _))
      .WillByDefault([&](auto&, auto, const PlanQuery& query) {
        asked.push_back(query.inferred);
        return absl::StatusOr<PlanResult>(plan);
      });
  ON_CALL(db_.planning(), CheckShape(_, _, _))
      .WillByDefault([&](auto&, auto, const ShapeQuery& query) {
        asked.push_back(query.inferred);
        ShapeCheck check;
        check.free = false;
        check.contacts.push_back({.from_m = 0.5, .to_m = 0.6, .inferred = true});
        return absl::StatusOr<ShapeCheck>(check);
      });
  ON_CALL(db_.planning(), WatchPath(_, _, _, _))
      .WillByDefault([&](auto&, auto, const PathQuery& query, auto) {
        asked.push_back(query.inferred);
        return absl::OkStatus();
      });
  ON_CALL(db_.planning(), Explore(_, _, _))
      .WillByDefault([&](auto&, auto, const ExploreQuery& query) {
        asked.push_back(query.inferred);
        return absl::StatusOr<ExploreResult>(ExploreResult());
      });
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto name) {
    return absl::StatusOr<MapInfo>(MapInfo{std::string(name), {}, {}});
  });
  const std::vector<std::string> words = {
      "plan", "m", "--from", "0,0", "--to", "1,0", "--shape-box", "1,1,1", "--watch"};
  const auto with = [](std::vector<std::string> all, const char* as) {
    all.emplace_back("--inferred");
    all.emplace_back(as);
    return all;
  };
  EXPECT_TRUE(Run(words, OutputFormat::kText).ok());
  EXPECT_THAT(asked, ElementsAre(InferredAs::kIgnore, InferredAs::kIgnore, InferredAs::kIgnore));
  asked.clear();
  EXPECT_THAT(RunText(with(words, "obstacle")), HasSubstr("0.000 m deep, only inferred, at"));
  EXPECT_TRUE(Run(with({"explore", "m", "--from", "0,0"}, "obstacle"), OutputFormat::kText).ok());
  EXPECT_THAT(asked,
              ElementsAre(InferredAs::kObstacle,
                          InferredAs::kObstacle,
                          InferredAs::kObstacle,
                          InferredAs::kObstacle));
  plan.message = "found; nothing is inferred in this map (objects complete)";
  RunText(with({"plan", "m", "--from", "0,0", "--to", "1,0"}, "obstacle"));
  EXPECT_THAT(talk_.str(), HasSubstr("nothing is inferred"));
  plan.reason = PlanReason::kBlocked;
  plan.obstruction = Obstruction::kObstacle;
  plan.inferred = true;
  EXPECT_EQ(RunJson({"plan", "m", "--from", "0,0", "--to", "1,0"})["inferred"], true);
}

}  // namespace
}  // namespace strata::cli
