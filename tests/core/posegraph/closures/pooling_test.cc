#include "core/posegraph/closures/pooling.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::RandomPoses;
using Nodes = std::vector<std::size_t>;

Nodes Range(std::size_t first, std::size_t last) {
  Nodes nodes(last - first + 1);
  std::iota(nodes.begin(), nodes.end(), first);
  return nodes;
}

std::vector<Nodes> NodesOf(const std::vector<Pool>& pools) {
  std::vector<Nodes> nodes;
  for (const Pool& pool : pools) nodes.push_back(pool.nodes);
  return nodes;
}

TEST(MakePoolsTest, NeighboursShareAScanAndTheLastTakesTheRest) {
  const std::vector<Nodes> trajectories = {Range(0, 6)};
  EXPECT_THAT(NodesOf(MakePools(trajectories, 3)),
              ElementsAre(Nodes{0, 1, 2}, Nodes{2, 3, 4}, Nodes{4, 5, 6}));
  EXPECT_THAT(NodesOf(MakePools(trajectories, 4)),
              ElementsAre(Nodes{0, 1, 2, 3}, Nodes{3, 4, 5, 6}));
  EXPECT_THAT(NodesOf(MakePools(trajectories, 5)),
              ElementsAre(Nodes{0, 1, 2, 3, 4}, Nodes{4, 5, 6}));
  EXPECT_THAT(NodesOf(MakePools(trajectories, 50)), ElementsAre(Range(0, 6)));
}

TEST(MakePoolsTest, TrajectoriesShareNoPool) {
  const std::vector<Nodes> trajectories = {{4, 1}, {}, {3}, {0, 5, 2}};
  EXPECT_THAT(NodesOf(MakePools(trajectories, 2)),
              ElementsAre(Nodes{4, 1}, Nodes{3}, Nodes{0, 5}, Nodes{5, 2}));
  EXPECT_THAT(MakePools({}, 2), IsEmpty());
}

TEST(MakePoolsTest, EveryScanIsInAPoolAndEveryStepInOne) {
  for (std::size_t length = 1; length <= 30; ++length) {
    for (std::size_t size = 2; size <= 12; ++size) {
      SCOPED_TRACE(::testing::Message() << length << " scans in pools of " << size);
      const std::vector<Nodes> trajectories = {Range(0, length - 1)};
      std::map<std::size_t, int> steps;  // to the scan after
      std::map<std::size_t, int> seen;
      for (const Pool& pool : MakePools(trajectories, size)) {
        ASSERT_LE(pool.nodes.size(), size);
        ASSERT_GE(pool.nodes.size(), std::min<std::size_t>(length, 2));
        for (const std::size_t node : pool.nodes) ++seen[node];
        for (std::size_t k = 1; k < pool.nodes.size(); ++k) {
          ASSERT_EQ(pool.nodes[k], pool.nodes[k - 1] + 1);
          ++steps[pool.nodes[k - 1]];
        }
      }
      EXPECT_EQ(seen.size(), length);
      EXPECT_EQ(steps.size(), length - 1);
      for (const auto& [step, times] : steps) EXPECT_EQ(times, 1) << step;
    }
  }
}

// Three pools of a chain of seven, and terms between everything.
class PoolGraphTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kScans = 7;

  PoolGraphTest() : random_(11), pools_(MakePools(std::vector<Nodes>{Range(0, kScans - 1)}, 3)) {
    for (std::size_t k = 0; k < kScans; ++k) graph_.T_map_scan.push_back(random_.AnyPose());
  }

  RelativePoseTerm TermOf(std::size_t i, std::size_t j, const Vector6d& error) {
    const Pose T_i_j = graph_.T_map_scan[i].inverse() * graph_.T_map_scan[j];
    return {i, j, Retract(T_i_j, error), random_.Information(), i + 2 < j};
  }
  void RelateAll(double error) {
    for (std::size_t i = 0; i < kScans; ++i) {
      for (std::size_t j = 0; j < kScans; ++j) {
        if (i == j) continue;
        graph_.relative.push_back(TermOf(i, j, random_.Step(error, error)));
      }
      graph_.priors.push_back(
          {i, Retract(graph_.T_map_scan[i], random_.Step(error, error)), random_.Information()});
    }
  }
  // Of 0 to 2 the first, of 2 to 4 the second: a shared scan is of the one it begins.
  static std::size_t PoolOf(std::size_t node) { return std::min<std::size_t>(node / 2, 2); }

  RandomPoses random_;
  std::vector<Pool> pools_;
  PoseGraphProblem graph_;
};

TEST_F(PoolGraphTest, WhatAgreesStillAgrees) {
  RelateAll(0.0);
  const PoseGraphProblem pooled = PoolGraph(graph_, pools_);
  ASSERT_EQ(pooled.T_map_scan.size(), 3U);
  for (std::size_t p = 0; p < 3; ++p) {
    EXPECT_TRUE(pooled.T_map_scan[p].isApprox(graph_.T_map_scan[2 * p], 1e-12));
  }
  // Of 42 terms 2 · (1 + 1 + 3) are within a pool; two hold neighbours together by their scan.
  EXPECT_EQ(pooled.relative.size(), 42U - 10U + 2U);
  EXPECT_EQ(pooled.priors.size(), kScans);
  EXPECT_LT(Chi2(pooled), 1e-15);
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseGraphSolution solved, OptimizePoseGraph(pooled));
  EXPECT_LT(solved.summary.before.total(), 1e-15);
  for (std::size_t p = 0; p < 3; ++p) {
    EXPECT_TRUE(solved.T_map_scan[p].isApprox(pooled.T_map_scan[p], 1e-9));
  }
}

// Moves pools, and the scans with them: every pooled term must cost what the scans' own term does.
TEST_F(PoolGraphTest, TermsCostWhatTheyCostBetweenScans) {
  RelateAll(1e-4);
  for (std::size_t k = 0; k < graph_.relative.size(); ++k) {
    const RelativePoseTerm& term = graph_.relative[k];
    if (PoolOf(term.i) == PoolOf(term.j)) continue;
    SCOPED_TRACE(::testing::Message() << term.i << " to " << term.j);
    PoseGraphProblem one;
    one.T_map_scan = graph_.T_map_scan;
    one.relative = {term};
    const PoseGraphProblem pooled = PoolGraph(one, pools_);
    const RelativePoseTerm& carried = pooled.relative.back();
    EXPECT_EQ(carried.i, PoolOf(term.i));
    EXPECT_EQ(carried.j, PoolOf(term.j));
    EXPECT_EQ(carried.may_be_false, term.may_be_false);
    PoseGraphProblem alone = pooled;
    alone.relative = {carried};
    // To second order in the error; 1e-4 rad across some metres.
    EXPECT_NEAR(Chi2(alone), Chi2(one), 3e-3 * Chi2(one));
  }
}

TEST_F(PoolGraphTest, CarriedInformationIsThatOfDifferences) {
  const RelativePoseTerm term = TermOf(1, 5, Vector6d::Zero());
  graph_.relative = {term};
  const RelativePoseTerm carried = PoolGraph(graph_, pools_).relative.back();
  // A step on the pools' relative pose as a step on the scans'.
  const Pose T_pool_i = graph_.T_map_scan[0].inverse() * graph_.T_map_scan[1];
  const Pose T_pool_j = graph_.T_map_scan[4].inverse() * graph_.T_map_scan[5];
  const Eigen::MatrixXd J = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
        const Pose T_i_j = T_pool_i.inverse() * Retract(carried.T_i_j, step) * T_pool_j;
        const Pose moved = term.T_i_j.inverse() * T_i_j;
        Vector6d error;
        error << So3Log(moved.linear()), moved.translation();
        return error;
      },
      6);
  const Matrix6d expected = J.transpose() * term.information * J;
  EXPECT_LT((carried.information - expected).norm(), 1e-6 * expected.norm());
}

TEST_F(PoolGraphTest, PriorsAreCarriedToo) {
  RelateAll(1e-4);
  graph_.relative.clear();
  for (const PriorTerm& prior : graph_.priors) {
    SCOPED_TRACE(prior.i);
    PoseGraphProblem one;
    one.T_map_scan = graph_.T_map_scan;
    one.priors = {prior};
    PoseGraphProblem pooled = PoolGraph(one, pools_);
    ASSERT_EQ(pooled.priors.size(), 1U);
    EXPECT_EQ(pooled.priors[0].i, PoolOf(prior.i));
    pooled.relative.clear();
    STRATA_ASSERT_OK_AND_ASSIGN(const PoseGraphSolution whole, OptimizePoseGraph(one));
    STRATA_ASSERT_OK_AND_ASSIGN(const PoseGraphSolution pools, OptimizePoseGraph(pooled));
    EXPECT_NEAR(pools.summary.before.priors,
                whole.summary.before.priors,
                3e-3 * whole.summary.before.priors);
    EXPECT_LT(pools.summary.after.priors, 1e-9);
  }
}

TEST_F(PoolGraphTest, APoolWithAFixedScanIsFixed) {
  EXPECT_THAT(PoolGraph(graph_, pools_).fixed, ElementsAre(false, false, false));
  graph_.fixed = {false, false, false, true, false, false, false};
  EXPECT_THAT(PoolGraph(graph_, pools_).fixed, ElementsAre(false, true, false));
}

TEST_F(PoolGraphTest, ScansFollowTheirPoolRigidly) {
  std::vector<Pose> T_map_pool;
  for (std::size_t p = 0; p < 3; ++p) T_map_pool.push_back(random_.AnyPose());
  const std::vector<Pose> after = UnpoolPoses(pools_, T_map_pool, graph_.T_map_scan);
  ASSERT_EQ(after.size(), kScans);
  for (std::size_t p = 0; p < 3; ++p) {
    EXPECT_TRUE(after[2 * p].isApprox(T_map_pool[p], 1e-9)) << p;  // the later of a shared one's
  }
  for (std::size_t i = 0; i < kScans; ++i) {
    for (std::size_t j = 0; j < kScans; ++j) {
      if (PoolOf(i) != PoolOf(j)) continue;
      const Pose before = graph_.T_map_scan[i].inverse() * graph_.T_map_scan[j];
      EXPECT_TRUE((after[i].inverse() * after[j]).isApprox(before, 1e-9)) << i << " " << j;
    }
  }
}

}  // namespace
}  // namespace strata
