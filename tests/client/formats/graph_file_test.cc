#include "client/formats/graph_file.h"

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "core/posegraph/solver/initial_poses.h"
#include "core/posegraph/solver/optimize_planar_pose_graph.h"
#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kSpatial[] =
    "# a comment\n"
    "VERTEX_SE3:QUAT 20 1 2 3 0 0 0.70710678118654757 0.70710678118654757\n"
    "VERTEX_SE3:QUAT 7 0 0 0 0 0 0 1\n"
    "FIX 7\n"
    "EDGE_SE3:QUAT 7 20 1 2 3.5 0 0 0.70710678118654757 0.70710678118654757 "
    "1 0 0 0 0 0.5 2 0 0 0 0 3 0 0 0 40 0 0 50 0 60\n";
constexpr char kPlanar[] =
    "VERTEX2 0 0 0 0\nVERTEX2 3 1 2 0.5\nEDGE2 0 3 1 2 0.5 11 0.1 12 33 0.2 0.3\n";

TEST(GraphFileTest, G2oIsRead) {
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile file, ParseGraph(kSpatial));
  EXPECT_THAT(file.ids, ElementsAre(7, 20));
  EXPECT_TRUE(file.has_poses);
  const auto& graph = std::get<PoseGraphProblem>(file.graph);
  EXPECT_THAT(graph.fixed, ElementsAre(true, false));
  const Eigen::Vector3d ahead = graph.T_map_scan[1] * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((ahead - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12);
  ASSERT_EQ(graph.relative.size(), 1U);
  EXPECT_EQ(graph.relative[0].i, 0U);
  EXPECT_EQ(graph.relative[0].j, 1U);
  // The only error is 0.5 m along z, with information 3: that of the file's third row.
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(graph));
  EXPECT_NEAR(solution.summary.before.total(), 3.0 * 0.25, 1e-12);
  // vec q is half the rotation; x's information with vec q's z is 0.5.
  EXPECT_NEAR(graph.relative[0].information(2, 2), 60.0 / 4.0, 1e-12);
  EXPECT_NEAR(graph.relative[0].information(2, 3), 0.5 / 2.0, 1e-12);
}

TEST(GraphFileTest, ToroIsRead) {
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile planar, ParseGraph(kPlanar));
  const auto& edge = std::get<PlanarPoseGraph>(planar.graph).relative.at(0);
  Eigen::Matrix3d expected;
  expected << 11, 0.1, 0.2, 0.1, 12, 0.3, 0.2, 0.3, 33;
  EXPECT_EQ(edge.information, expected);
  STRATA_ASSERT_OK_AND_ASSIGN(
      const GraphFile spatial,
      ParseGraph("VERTEX3 0 0 0 0 0 0 0\nVERTEX3 1 1 2 3 0.1 0.2 0.3\nEDGE3 0 1 1 2 3 0.1 0.2 0.3\n"
                 "EDGE3 1 0 1 2 3 0.1 0.2 0.3 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n"));
  const auto& graph = std::get<PoseGraphProblem>(spatial.graph);
  EXPECT_TRUE(graph.relative[0].T_i_j.isApprox(graph.T_map_scan[1]));
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  EXPECT_TRUE(graph.T_map_scan[1].linear().isApprox(R));
  EXPECT_EQ(graph.relative[0].information, Matrix6d(Matrix6d::Identity()));
  Vector6d diagonal;
  diagonal << 4, 5, 6, 1, 2, 3;
  EXPECT_EQ(graph.relative[1].information, Matrix6d(diagonal.asDiagonal()));
}

TEST(GraphFileTest, EdgesAloneMakeAGraph) {
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile file,
                              ParseGraph("EDGE_SE2 5 9 1 0 0  1 0 0 1 0 1\r\n"));
  EXPECT_FALSE(file.has_poses);
  EXPECT_THAT(file.ids, ElementsAre(5, 9));
  EXPECT_EQ(std::get<PlanarPoseGraph>(file.graph).poses.size(), 2U);
}

TEST(GraphFileTest, WhatIsWrittenIsReadBack) {
  for (const char* text : {kSpatial, kPlanar}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile file, ParseGraph(text));
    const std::string written = G2oText(file);
    STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile again, ParseGraph(written));
    EXPECT_EQ(again.ids, file.ids);
    if (const auto* graph = std::get_if<PoseGraphProblem>(&file.graph)) {
      const auto& other = std::get<PoseGraphProblem>(again.graph);
      EXPECT_EQ(other.fixed, graph->fixed);
      for (std::size_t n = 0; n < file.ids.size(); ++n) {
        EXPECT_TRUE(other.T_map_scan[n].isApprox(graph->T_map_scan[n], 1e-15));
      }
      EXPECT_TRUE(other.relative[0].information.isApprox(graph->relative[0].information, 1e-15));
    } else {
      EXPECT_EQ(G2oText(again), written);
    }
  }
}

TEST(GraphFileTest, ErrorsNameLineValueAndCure) {
  const auto expect = [](const std::string& text, const std::string& message) {
    EXPECT_THAT(ParseGraph(text), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "expected vertices or edges");
  expect("FIX 0\n", "expected vertices or edges");
  expect("\nVERTEX_XY 0 1 2\n", "line 2: 'VERTEX_XY' is none of VERTEX_SE3:QUAT");
  expect("VERTEX_SE2 0 1 2\n", "VERTEX_SE2 takes 1 vertex and 3 numbers, found 2 numbers");
  expect("VERTEX_SE2\n", "VERTEX_SE2 without a vertex");
  expect("VERTEX_SE2 -1 0 0 0\n", "found '-1'");
  expect("VERTEX_SE2 1 0 nan 0\n", "found 'nan'");
  expect("VERTEX_SE2 1 0 0 0\nVERTEX_SE2 1 0 0 0\n", "line 2: vertex 1 comes twice");
  expect("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 2\n", "quaternion has length 2");
  expect("VERTEX_SE2 1 0 0 0\nEDGE_SE2 1 2 0 0 0 1 0 0 1 0 1\n",
         "line 2: vertex 2 is not in the file; add its line");
  expect("VERTEX_SE2 1 0 0 0\nFIX 3\n", "line 2: vertex 3 is not in the file");
  expect("EDGE_SE2 1 1 0 0 0 1 0 0 1 0 1\n", "an edge from vertex 1 to itself");
  expect("EDGE_SE2 1\n", "EDGE_SE2 without two vertices");
  expect("VERTEX_SE2 1 0 0 0\nVERTEX3 2 0 0 0 0 0 0\n", "split it into two graphs");
  EXPECT_THAT(ReadGraph("/nowhere/x.g2o"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("x.g2o")));
}

// [1 2; 2 1] has the eigenvalues 3 and -1; without the latter 1.5 [1 1; 1 1] is left.
TEST(GraphFileTest, IndefiniteInformationIsClippedAndCounted) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const GraphFile planar,
      ParseGraph("EDGE_SE2 1 2 0 0 0 1 2 0 1 0 7\nEDGE_SE2 2 3 0 0 0 1 0 0 1 0 1\n"
                 "EDGE_SE2 3 4 0 0 0 -4 0 0 1 0 1\n"));
  const auto& edges = std::get<PlanarPoseGraph>(planar.graph).relative;
  Eigen::Matrix3d nearest;
  nearest << 1.5, 1.5, 0, 1.5, 1.5, 0, 0, 0, 7;
  EXPECT_TRUE(edges[0].information.isApprox(nearest, 1e-12)) << edges[0].information;
  EXPECT_EQ(edges[1].information, Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(
      edges[2].information.isApprox(Eigen::Matrix3d(Eigen::Vector3d(0, 1, 1).asDiagonal()), 1e-12));
  EXPECT_EQ(planar.clipped, 2U);
  EXPECT_NEAR(planar.least_eigenvalue, -4.0, 1e-12);
  EXPECT_THAT(ClippedWarning(planar), HasSubstr("2 of 3 "));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const GraphFile spatial,
      ParseGraph("EDGE3 0 1 0 0 0 0 0 0 1 2 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n"));
  EXPECT_EQ(spatial.clipped, 1U);
  EXPECT_NEAR(spatial.least_eigenvalue, -1.0, 1e-12);
  const Matrix6d& clipped = std::get<PoseGraphProblem>(spatial.graph).relative[0].information;
  EXPECT_NEAR(clipped(3, 4), 1.5, 1e-12);
  STRATA_ASSERT_OK_AND_ASSIGN(const GraphFile sound, ParseGraph(kPlanar));
  EXPECT_EQ(sound.clipped, 0U);
  EXPECT_EQ(ClippedWarning(sound), "");
}

// The nearest semidefinite matrix to a negative one is zero, which no constraint may have.
TEST(GraphFileTest, EdgesThatSayNothingAreDroppedAndCounted) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const GraphFile file,
      ParseGraph("VERTEX_SE2 1 0 0 0\nVERTEX_SE2 2 1 0 0\nVERTEX_SE2 3 2 0 0\n"
                 "EDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\nEDGE_SE2 2 3 1 0 0 -2 0 0 -3 0 -1\n"
                 "EDGE_SE2 1 3 2 0 0 0 0 0 0 0 0\n"));
  EXPECT_EQ(std::get<PlanarPoseGraph>(file.graph).relative.size(), 1U);
  EXPECT_EQ(file.ids.size(), 3U);
  EXPECT_EQ(file.clipped, 1U);
  EXPECT_EQ(file.dropped, 2U);
  EXPECT_THAT(ClippedWarning(file), HasSubstr("1 of 3 informations have a negative eigenvalue"));
  EXPECT_THAT(ClippedWarning(file), HasSubstr("2 of 3 informations have no positive eigenvalue"));
}

TEST(GraphFileTest, DamageIsAStatus) {
  std::mt19937_64 random(11);
  for (const std::string text : {kSpatial, kPlanar}) {
    for (int k = 0; k < 3000; ++k) {
      std::string damaged = text.substr(0, random() % (text.size() + 1));
      if (!damaged.empty()) damaged[random() % damaged.size()] = static_cast<char>(random());
      const auto file = ParseGraph(damaged);
      if (!file.ok()) {
        EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument) << file.status();
      }
    }
  }
}

// The optima that the folder's README states: computed by another program.
class RecordedGraphTest : public ::testing::Test {
 protected:
  static double OptimumOf(const std::filesystem::path& path, bool chordal) {
    auto file = ReadGraph(path);
    EXPECT_THAT(file, testing::IsOk());
    if (auto* graph = std::get_if<PoseGraphProblem>(&file->graph)) {
      if (chordal) graph->T_map_scan = ChordalPoses(*graph);
      const auto solution = OptimizePoseGraph(*graph);
      EXPECT_THAT(solution, testing::IsOk());
      return solution->summary.after.total();
    }
    auto& graph = std::get<PlanarPoseGraph>(file->graph);
    if (chordal) graph.poses = ChordalPoses(graph);
    const auto solution = OptimizePlanarPoseGraph(graph);
    EXPECT_THAT(solution, testing::IsOk());
    return solution->chi2_after;
  }
};

TEST_F(RecordedGraphTest, SmallOnesReachTheStatedOptimum) {
  STRATA_REQUIRE_DATA(folder, "posegraphs");
  EXPECT_NEAR(OptimumOf(folder / "g2o_3d/tinyGrid3D.g2o", false), 6.7278816, 1e-4 * 6.73);
  EXPECT_NEAR(OptimumOf(folder / "g2o_3d/smallGrid3D.g2o", true), 458.15378, 1e-4 * 458.0);
  EXPECT_NEAR(OptimumOf(folder / "g2o_2d/input_MITb_g2o.g2o", true), 41.163269, 1e-4 * 41.0);
  EXPECT_NEAR(OptimumOf(folder / "toro/FR079_P_toro.graph", false), 37.599116, 1e-4 * 37.6);
}

}  // namespace
}  // namespace strata
