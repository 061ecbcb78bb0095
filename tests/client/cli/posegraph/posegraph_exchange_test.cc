#include "client/cli/posegraph/posegraph_exchange.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

api::PoseGraphState TwoScans() {
  api::PoseGraphState state;
  for (const std::uint64_t sequence : {5, 9}) {
    PoseNode node;
    node.id = {"run", sequence};
    node.T_map_scan.translation().x() = static_cast<double>(sequence);
    state.nodes.push_back(node);
  }
  Constraint constraint;
  constraint.i = {"run", 5};
  constraint.j = {"run", 9};
  constraint.T_i_j =
      MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 3).normalized())),
               {4, 1, 2});
  constraint.information.setZero();
  constraint.information.diagonal() << 8, 12, 16, 1, 2, 3;
  constraint.information(0, 3) = constraint.information(3, 0) = 0.5;
  state.constraints.push_back(constraint);
  return state;
}

TEST(PosegraphExchangeTest, IsAG2oFileWithNames) {
  const ExportedGraph graph = ExportGraph(TwoScans());
  EXPECT_EQ(graph.vertices, 2U);
  EXPECT_EQ(graph.edges, 1U);
  EXPECT_THAT(graph.text, HasSubstr("# 0 run/5\n# 1 run/9\n"));
  EXPECT_THAT(graph.text, HasSubstr("VERTEX_SE3:QUAT 1 9 0 0 0 0 0 1\n"));
  // g2o's error is [translation, vector part of the quaternion = rotation / 2]: rotations count
  // four times, mixed blocks twice. Upper triangle, row by row.
  EXPECT_THAT(graph.text, HasSubstr(" 1 0 0 1 0 0 2 0 0 0 0 3 0 0 0 32 0 0 48 0 64\n"));
}

TEST(PosegraphExchangeTest, WhatIsWrittenReadsBack) {
  api::PoseGraphState state = TwoScans();
  Constraint prior = state.constraints[0];
  prior.i = {};
  prior.information.topRows<3>().setZero();
  prior.information.leftCols<3>().setZero();
  state.constraints.push_back(prior);
  const ExportedGraph exported = ExportGraph(state);
  EXPECT_THAT(exported.text, HasSubstr("# 2 map\n"));
  EXPECT_THAT(exported.text, HasSubstr("FIX 2"));
  STRATA_ASSERT_OK_AND_ASSIGN(const ImportedGraph imported, ParseGraphImport(exported.text));
  ASSERT_THAT(imported.constraints, SizeIs(2));
  EXPECT_TRUE(SaysTheSame(imported.constraints[0], state.constraints[0]));
  EXPECT_TRUE(SaysTheSame(imported.constraints[1], prior));
  EXPECT_TRUE(imported.constraints[1].is_prior());
  EXPECT_FALSE(SaysTheSame(imported.constraints[0], imported.constraints[1]));
  ASSERT_THAT(imported.poses, SizeIs(2));
  EXPECT_EQ(imported.poses.at({"run", 9}).translation().x(), 9.0);
}

TEST(PosegraphExchangeTest, WhatIsSwitchedOffStaysBehind) {
  api::PoseGraphState state = TwoScans();
  state.constraints[0].enabled = false;
  state.planes.resize(2);
  const ExportedGraph graph = ExportGraph(state);
  EXPECT_EQ(graph.edges, 0U);
  EXPECT_EQ(graph.left_out, 3U);
  EXPECT_THAT(graph.text, Not(HasSubstr("EDGE")));
}

TEST(PosegraphExchangeTest, BadFilesAreRefusedWithTheCure) {
  const std::string text = ExportGraph(TwoScans()).text;
  const auto import = [](const std::string& changed) { return ParseGraphImport(changed).status(); };
  const auto without = [&text](const std::string& part, const std::string& other) {
    std::string changed = text;
    return changed.replace(changed.find(part), part.size(), other);
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  EXPECT_THAT(import(without("# 1 run/9\n", "")),
              StatusIs(kInvalid, HasSubstr("add a line '# 1 TRAJECTORY/SEQUENCE'")));
  EXPECT_THAT(import(without("# 1 run/9", "# 1 run/5")),
              StatusIs(kInvalid, HasSubstr("run/5 has a vertex already")));
  EXPECT_THAT(import(without("# 1 run/9", "# 1 somewhere")),
              StatusIs(kInvalid, HasSubstr("TRAJECTORY/SEQUENCE")));
  EXPECT_THAT(import(without("# 1 run/9", "# 1 map")),
              StatusIs(kInvalid, HasSubstr("from the map to its scan")));
  EXPECT_THAT(import("# 0 a/1\n# 1 a/2\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n"
                     "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"),
              StatusIs(kInvalid, HasSubstr("planar")));
}

}  // namespace
}  // namespace strata::cli
