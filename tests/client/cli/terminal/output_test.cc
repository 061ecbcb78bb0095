#include "client/cli/terminal/output.h"

#include <sstream>
#include <string>
#include <vector>

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

TEST(OutputTest, AnglesOfATableAreDegrees) {
  const Json rows = {{{"turn_rad", 0.35}}, {{"turn_rad", -0.001}}, {{"turn_rad", Json()}}};
  std::ostringstream data;
  std::ostringstream json;
  std::ostringstream talk;
  Output(OutputFormat::kText, data, talk).List(rows, {{"turn_rad", "TURN"}});
  EXPECT_EQ(data.str(), "    TURN\n   20.1°\n-0.0573°\n       -\n");
  Output(OutputFormat::kJson, json, talk).List(rows, {{"turn_rad", "TURN"}});
  EXPECT_EQ(Json::parse(json.str()), rows);
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

TEST(OutputTest, NumbersOfJsonAreShort) {
  std::ostringstream data;
  std::ostringstream talk;
  Output(OutputFormat::kJson, data, talk)
      .JsonLine({{"a", -24.150000000000002},
                 {"b", 6.0},
                 {"c", 0.1 + 0.2},
                 {"d", 1.0 / 3.0},
                 {"e", 1e300},
                 {"f", -0.0},
                 {"g", 5412345.678901},
                 {"h", {1.0, 2.5}},
                 {"i", 18446744073709551615U}});
  EXPECT_EQ(data.str(),
            "{\"a\":-24.15,\"b\":6,\"c\":0.3,\"d\":0.333333333333333,\"e\":1e+300,\"f\":0,"
            "\"g\":5412345.678901,\"h\":[1,2.5],\"i\":18446744073709551615}\n");
}

TEST(OutputTest, CsvHasAColumnForEachKeyOfAnyRow) {
  std::ostringstream data;
  std::ostringstream talk;
  Output output(OutputFormat::kCsv, data, talk);
  output.Object({{"summary", 1}});
  output.List({{{"n", "a,b"}, {"at", {1.0, 2.5}}, {"in", {{"x", 1.5}}}},
               {{"n", "say \"hi\""}, {"late", true}, {"none", Json()}}},
              {{"n", "NAME"}});
  output.List({{{"second", 1}}}, {{"second", "SECOND"}});
  output.Text("text");
  output.Finish();
  EXPECT_EQ(data.str(),
            "n,at,in.x,late,none\n\"a,b\",\"[1,2.5]\",1.5,,\n\"say \"\"hi\"\"\",,,true,\n");
}

TEST(OutputTest, CsvOfOneThingIsARowAndOfNothingItsTitles) {
  std::ostringstream data;
  std::ostringstream talk;
  Output one(OutputFormat::kCsv, data, talk);
  one.Object({{"name", "m"}, {"scans", 3}});
  one.Finish();
  EXPECT_EQ(data.str(), "name,scans\nm,3\n");
  data.str("");
  Output none(OutputFormat::kCsv, data, talk);
  none.List(Json::array(), {{"name", "NAME"}, {"scans", "SCANS"}});
  none.Finish();
  EXPECT_EQ(data.str(), "name,scans\n");
  data.str("");
  Output lines(OutputFormat::kCsv, data, talk);
  lines.JsonLine({{"a", 1}, {"b", "x"}});
  lines.JsonLine({{"b", "y"}, {"c", 2}});
  lines.Finish();
  EXPECT_EQ(data.str(), "a,b\n1,x\n,y\n");
  EXPECT_EQ(talk.str(), "");
  Output(OutputFormat::kCsv, data, talk).Finish();
  EXPECT_NE(talk.str().find("--output json"), std::string::npos);
}

TEST(OutputTest, ATerminalGetsWhatItShowsAndAPipeGetsAll) {
  Json rows = Json::array();
  for (int i = 0; i < 100; ++i)
    rows.push_back({{"id", i}, {"note", "one two three four five six"}});
  const std::vector<Column> columns = {{"id", "ID"}, {"note", "NOTE"}};
  std::ostringstream data;
  std::ostringstream talk;
  Output(OutputFormat::kText, data, talk, {.columns = 24, .rows = 12, .colour = false})
      .List(rows, columns);
  EXPECT_EQ(data.str().substr(0, 51), "ID  NOTE\n 0  one two three four\n    five six\n 1  on");
  EXPECT_NE(data.str().find("… and 92 more"), std::string::npos) << data.str();
  data.str("");
  Output(OutputFormat::kText, data, talk).List(rows, columns);
  EXPECT_EQ(data.str().find("…"), std::string::npos);
  EXPECT_NE(data.str().find("99  one two three four five six\n"), std::string::npos);
}

TEST(OutputTest, WhatDoesNotFitBesideTheOthersStandsBelow) {
  const Json rows = {{{"id", "0123456789"}, {"note", "one two three four five six"}},
                     {{"id", "1"}, {"note", "short"}}};
  std::ostringstream data;
  Output(OutputFormat::kText, data, data, {.columns = 24, .rows = 24, .colour = false})
      .List(rows, {{"id", "ID"}, {"note", "NOTE"}});
  EXPECT_EQ(data.str(),
            "ID          NOTE\n"
            "0123456789\n"
            "    one two three four\n"
            "    five six\n"
            "1           short\n");
}

TEST(OutputTest, VerdictsWarningsAndErrorsHaveColour) {
  const Screen colour{.columns = 0, .rows = 0, .colour = true};
  std::ostringstream data;
  std::ostringstream talk;
  Output output(OutputFormat::kText, data, talk, colour, colour);
  output.Object({{"state", "failed"}, {"name", "failed"}});
  output.Verdict("no path", false);
  output.Talk("error: broken");
  output.Talk("warning: odd");
  EXPECT_EQ(data.str(), "state  \x1b[31mfailed\x1b[0m\nname   failed\n\x1b[31mno path\x1b[0m\n");
  EXPECT_EQ(talk.str(), "\x1b[31merror:\x1b[0m broken\n\x1b[33mwarning:\x1b[0m odd\n");
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
