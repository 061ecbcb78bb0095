// strata posegraph optimize, as its users run it: without a server.
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/graph_file.h"
#include "core/posegraph/solver/optimize_planar_pose_graph.h"
#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A square of four metres with a closure, measured 1 % too long on one side, and a closure between
// opposite corners that is wrong.
constexpr char kSquare[] =
    "EDGE_SE2 10 20 4.04 0 1.5707963267948966 100 0 0 100 0 400\n"
    "EDGE_SE2 20 30 4 0 1.5707963267948966 100 0 0 100 0 400\n"
    "EDGE_SE2 30 40 4 0 1.5707963267948966 100 0 0 100 0 400\n"
    "EDGE_SE2 40 10 4 0 1.5707963267948966 100 0 0 100 0 400\n";
constexpr char kFalse[] = "EDGE_SE2 10 30 0.5 0 0 100 0 0 100 0 400\n";

class PosegraphOptimizeTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& text) {
    const auto path = dir_.path() / "in.g2o";
    STRATA_EXPECT_OK(WriteFileBytes(path, text));
    return path.string();
  }
  Ran Optimize(const std::string& text, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {
        "posegraph", "optimize", Write(text), "--out", out_, "--output", "json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunStrata(arguments);
  }
  testing::TempDir dir_;
  std::string out_ = (dir_.path() / "out.g2o").string();
};

TEST_F(PosegraphOptimizeTest, ClosesTheSquareAndSaysSo) {
  const Ran ran = Optimize(kSquare);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const json report = json::parse(ran.out);
  EXPECT_LT(report["cost_after"], report["cost_before"]);
  EXPECT_EQ(report["vertices"], 4);
  EXPECT_EQ(report["edges"], 4);
  EXPECT_EQ(report["stopped"], "converged");
  EXPECT_GT(report["iterations"], 0);
  EXPECT_GT(report["elapsed_ms"], 0.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile solved, ReadGraph(out_));
  EXPECT_THAT(solved.ids, ElementsAre(10, 20, 30, 40));
  EXPECT_NEAR(Chi2(std::get<PlanarPoseGraph>(solved.graph)), report["cost_after"], 1e-12);
}

TEST_F(PosegraphOptimizeTest, RobustRejectsTheFalseEdge) {
  const Ran clean = Optimize(kSquare);
  const Ran robust = Optimize(std::string(kSquare) + kFalse, {"--robust"});
  ASSERT_EQ(robust.exit_code, 0) << robust.err;
  EXPECT_EQ(json::parse(robust.out)["rejected"], json::parse("[[10, 30]]"));
  STRATA_ASSERT_OK_AND_ASSIGN(GraphFile solved, ReadGraph(out_));
  auto& graph = std::get<PlanarPoseGraph>(solved.graph);
  graph.relative.pop_back();
  EXPECT_NEAR(Chi2(graph), json::parse(clean.out)["cost_after"], 1e-6);
}

TEST_F(PosegraphOptimizeTest, EveryStartLeadsThere) {
  const json best = json::parse(Optimize(kSquare).out);
  for (const char* start : {"odometry", "chordal"}) {
    const json report = json::parse(Optimize(kSquare, {"--start", start}).out);
    EXPECT_EQ(report["start"], start);
    EXPECT_NEAR(report["cost_after"], best["cost_after"], 1e-9);
  }
  const Ran ran = Optimize(kSquare, {"--start", "file"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, HasSubstr("has edges only; --start odometry or chordal"));
}

TEST_F(PosegraphOptimizeTest, ErrorsNameFileLineAndCure) {
  Ran ran = Optimize("EDGE_SE2 1 2 0 0\n");
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, HasSubstr("in.g2o: line 1: EDGE_SE2 takes 2 vertices and 9 numbers"));
  ran = RunStrata({"posegraph", "optimize", "/nowhere.g2o", "--out", out_});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, HasSubstr("nowhere.g2o"));
  ran = RunStrata({"posegraph", "optimize", "--help"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_THAT(ran.out, HasSubstr("strata posegraph optimize sphere2500.g2o"));
}

}  // namespace
}  // namespace strata::cli
