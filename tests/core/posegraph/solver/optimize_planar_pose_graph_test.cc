#include "core/posegraph/solver/optimize_planar_pose_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/posegraph/costs/planar_cost.h"
#include "core/posegraph/solver/initial_poses.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

class PlanarPoseGraphTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  PlanarPose AnyPose() {
    return {random_.Normal(10.0), random_.Normal(10.0), WrapAngle(random_.Normal(2.0))};
  }
  // The pose of j in i.
  static PlanarPose Between(const PlanarPose& i, const PlanarPose& j) {
    return PlanarError(i, j, PlanarPose::Zero());
  }
  void MakeGraph(std::size_t nodes, double noise) {
    for (std::size_t n = 0; n < nodes; ++n) truth_.push_back(AnyPose());
    const auto add = [&](std::size_t i, std::size_t j, bool may_be_false) {
      const Eigen::Vector3d step = noise * random_.Vector(1.0);
      graph_.relative.push_back({.i = i,
                                 .j = j,
                                 .T_i_j = Moved(Between(truth_[i], truth_[j]), step),
                                 .information = Eigen::Vector3d(0.7, 0.8, 0.9).asDiagonal(),
                                 .may_be_false = may_be_false});
      graph_.relative.back().information *= 1.0 / std::max(1e-4, noise * noise);
    };
    for (std::size_t n = 1; n < nodes; ++n) add(n - 1, n, false);
    for (std::size_t n = 5; n < nodes; n += 2) add(n, random_.Below(n - 3), true);
    graph_.poses = truth_;
    graph_.poses = OdometryPoses(graph_);
  }
  testing::RandomPoses random_{GetParam()};
  std::vector<PlanarPose> truth_;
  PlanarPoseGraph graph_;
};

TEST_P(PlanarPoseGraphTest, WithoutNoiseStartsAndOptimumAreTheTruth) {
  MakeGraph(30, 0.0);
  const std::vector<PlanarPose> chordal = ChordalPoses(graph_);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePlanarPoseGraph(graph_));
  for (std::size_t n = 0; n < truth_.size(); ++n) {
    EXPECT_LT(Between(truth_[n], chordal[n]).norm(), 1e-6);
    EXPECT_LT(Between(truth_[n], solution.poses[n]).norm(), 1e-6);
  }
  EXPECT_EQ(solution.termination, PoseGraphTermination::kConverged);
}

TEST_P(PlanarPoseGraphTest, NoNeighbourIsBetter) {
  MakeGraph(30, 0.05);
  for (PlanarRelativeTerm& term : graph_.relative) term.may_be_false = false;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePlanarPoseGraph(graph_));
  EXPECT_LT(solution.chi2_after, solution.chi2_before);
  PlanarPoseGraph neighbour = graph_;
  neighbour.poses = solution.poses;
  EXPECT_DOUBLE_EQ(Chi2(neighbour), solution.chi2_after);
  for (int k = 0; k < 300; ++k) {
    const double size = std::pow(10.0, -0.02 * k);
    neighbour.poses = solution.poses;
    for (PlanarPose& pose : neighbour.poses) pose = Moved(pose, random_.Vector(size));
    EXPECT_GE(Chi2(neighbour), solution.chi2_after * (1.0 - 1e-7));
  }
}

TEST_P(PlanarPoseGraphTest, FalseClosuresAreRejected) {
  MakeGraph(40, 0.02);
  const std::size_t false_one = graph_.relative.size();
  graph_.relative.push_back({.i = 3, .j = 30, .T_i_j = AnyPose(), .may_be_false = true});
  graph_.relative.back().information *= 1e4;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePlanarPoseGraph(graph_));
  EXPECT_THAT(solution.rejected, ::testing::Contains(false_one));
  EXPECT_LE(solution.rejected.size(), 2U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlanarPoseGraphTest, ::testing::Values(1, 2, 3));

TEST(PlanarErrorsTest, NameTheTerm) {
  PlanarPoseGraph graph;
  graph.poses.assign(2, PlanarPose::Zero());
  graph.relative.push_back({.i = 0, .j = 2});
  EXPECT_THAT(OptimizePlanarPoseGraph(graph),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("relative pose 0: j is 2")));
  graph.relative[0].j = 1;
  graph.relative[0].information(0, 0) = -1.0;
  EXPECT_THAT(OptimizePlanarPoseGraph(graph),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("negative eigenvalue")));
  graph.relative.clear();
  graph.poses[1].x() = NAN;
  EXPECT_THAT(OptimizePlanarPoseGraph(graph),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("pose 1: pose: not finite")));
}

}  // namespace
}  // namespace strata
