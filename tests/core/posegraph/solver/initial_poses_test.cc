#include "core/posegraph/solver/initial_poses.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

class InitialPosesTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  // Two components of 20 nodes, all kinds of turns, nothing known of where nodes are but the first
  // of each.
  void SetUp() override {
    for (std::size_t n = 0; n < 40; ++n) truth_.push_back(random_.AnyPose(20.0));
    problem_.T_map_scan.assign(40, Pose::Identity());
    for (const std::size_t first : {0U, 20U}) {
      problem_.T_map_scan[first] = truth_[first];
      for (std::size_t n = first + 1; n < first + 20; ++n) Add(n, n - 1);
      for (int k = 0; k < 15; ++k) {
        const std::size_t i = first + random_.Below(20);
        const std::size_t j = first + random_.Below(20);
        if (i != j) Add(i, j);
      }
    }
  }
  void Add(std::size_t i, std::size_t j) {
    problem_.relative.push_back({.i = i,
                                 .j = j,
                                 .T_i_j = truth_[i].inverse() * truth_[j],
                                 .information = random_.Information()});
  }
  testing::RandomPoses random_{GetParam()};
  std::vector<Pose> truth_;
  PoseGraphProblem problem_;
};

TEST_P(InitialPosesTest, WithoutNoiseBothAreTheTruth) {
  const std::vector<Pose> odometry = OdometryPoses(problem_);
  const std::vector<Pose> chordal = ChordalPoses(problem_);
  for (std::size_t n = 0; n < 40; ++n) {
    EXPECT_TRUE(odometry[n].isApprox(truth_[n], 1e-9)) << n;
    EXPECT_TRUE(chordal[n].isApprox(truth_[n], 1e-6)) << n;
  }
}

TEST_P(InitialPosesTest, FixedNodesStayAndAnchor) {
  problem_.fixed.assign(40, false);
  problem_.fixed[7] = problem_.fixed[12] = true;
  problem_.T_map_scan[0] = Pose::Identity();
  problem_.T_map_scan[7] = truth_[7];
  problem_.T_map_scan[12] = truth_[12];
  const std::vector<Pose> odometry = OdometryPoses(problem_);
  const std::vector<Pose> chordal = ChordalPoses(problem_);
  for (std::size_t n = 0; n < 40; ++n) {
    EXPECT_TRUE(odometry[n].isApprox(truth_[n], 1e-9)) << n;
    EXPECT_TRUE(chordal[n].isApprox(truth_[n], 1e-6)) << n;
  }
}

TEST_P(InitialPosesTest, WithNoiseChordalIsNearerThanOdometry) {
  for (RelativePoseTerm& term : problem_.relative) {
    term.T_i_j = Retract(term.T_i_j, random_.Step(0.1, 0.1));
  }
  PoseGraphProblem started = problem_;
  started.T_map_scan = ChordalPoses(problem_);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto chordal, OptimizePoseGraph(started));
  started.T_map_scan = OdometryPoses(problem_);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto odometry, OptimizePoseGraph(started));
  EXPECT_LT(chordal.summary.before.total(), 0.5 * odometry.summary.before.total());
  EXPECT_GE(odometry.summary.after.total(), chordal.summary.after.total() * (1.0 - 1e-6));
}

INSTANTIATE_TEST_SUITE_P(Seeds, InitialPosesTest, ::testing::Values(1, 2, 3));

TEST(InitialPosesOfNothingTest, AreWhatWasGiven) {
  PoseGraphProblem problem;
  EXPECT_TRUE(OdometryPoses(problem).empty());
  EXPECT_TRUE(ChordalPoses(problem).empty());
  problem.T_map_scan.assign(2, MakePose(Eigen::Quaterniond::Identity(), {1, 2, 3}));
  EXPECT_TRUE(ChordalPoses(problem)[1].isApprox(problem.T_map_scan[1]));
}

}  // namespace
}  // namespace strata
