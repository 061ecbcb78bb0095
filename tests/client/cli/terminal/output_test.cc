#include "client/cli/terminal/output.h"

#include <sstream>

#include <gtest/gtest.h>

#include "client/cli/terminal/json.h"

namespace strata::cli {
namespace {

TEST(OutputTest, TableAlignsNumbersRightAndWordsLeft) {
  std::ostringstream data;
  std::ostringstream talk;
  Output output(OutputFormat::kText, data, talk);
  output.List({{{"n", "a"}, {"v", 5}}, {{"n", "long"}, {"v", 1200}}, {{"n", "x"}, {"v", 7}}},
              {{"n", "NAME"}, {"v", "VALUE"}});
  EXPECT_EQ(data.str(), "NAME  VALUE\na         5\nlong   1200\nx         7\n");
  EXPECT_EQ(talk.str(), "");
}

TEST(OutputTest, ObjectIsKeysAndValuesOrJson) {
  const Json object = {{"name", "a"}, {"box", {1.5, 2}}, {"empty", Json::array()}, {"yes", true}};
  std::ostringstream text;
  std::ostringstream json;
  std::ostringstream talk;
  Output(OutputFormat::kText, text, talk).Object(object);
  Output(OutputFormat::kJson, json, talk).Object(object);
  EXPECT_EQ(text.str(), "name   a\nbox    1.5, 2\nempty  -\nyes    yes\n");
  EXPECT_EQ(Json::parse(json.str()), object);
}

TEST(OutputTest, TextHasNoMoreDecimalsThanMeanSomething) {
  std::ostringstream data;
  std::ostringstream talk;
  Output(OutputFormat::kText, data, talk)
      .Object({{"a", -59.300000000000004},
               {"b", 6.123233995736766e-17},
               {"c", -1e-9},
               {"d", 5412345.678901},
               {"e", 1e300},
               {"f", 2.0},
               {"g", 0.35},
               {"h", 120.0}});
  EXPECT_EQ(data.str(),
            "a  -59.3\nb  0.0\nc  0.0\nd  5412345.678901\ne  1e+300\nf  2.0\ng  0.35\nh  120.0\n");
}

TEST(OutputTest, JsonModeKeepsTextOffStdout) {
  std::ostringstream data;
  std::ostringstream talk;
  Output output(OutputFormat::kJson, data, talk);
  output.Text("hello");
  output.Talk("progress");
  EXPECT_EQ(data.str(), "");
  EXPECT_EQ(talk.str(), "progress\n");
}

TEST(JsonTest, PlanHasTheKeysThatScriptsRead) {
  PlanResult plan;
  plan.waypoints = {{1, 2, 3}, {4, 5, 6}};
  plan.gaps = {{{0, 0, 0}, {1, 0, 0}, 1.0}};
  const Json json = ToJson(plan);
  for (const char* key : {"found",
                          "reason",
                          "length_m",
                          "cost",
                          "waypoints",
                          "expanded",
                          "elapsed_ms",
                          "epoch",
                          "gaps"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["reason"], "found");
  EXPECT_EQ(json["waypoints"], Json({{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}}));
}

TEST(JsonTest, BlockedPlanSaysWhereAndByWhat) {
  PlanResult plan;
  plan.reason = PlanReason::kBlocked;
  plan.obstruction = Obstruction::kStep;
  plan.obstruction_value = 0.31;
  plan.where = Eigen::Vector3d(1, 2, 3);
  const Json json = ToJson(plan);
  EXPECT_EQ(json["found"], false);
  EXPECT_EQ(json["obstruction"], "step");
  EXPECT_EQ(json["obstruction_value"], 0.31);
  EXPECT_EQ(json["where"], Json({1.0, 2.0, 3.0}));
}

}  // namespace
}  // namespace strata::cli
