#include "core/classification/amn/amn_inference.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/classification/amn/random_networks.h"
#include "tests/core/classification/amn/relaxation.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::AmnRelaxation;
using testing::BestScoreByEnumeration;
using testing::RandomEdges;
using testing::RandomProblem;
using testing::RelaxScore;

TEST(AmnInferenceTest, TwoClassesAreExact) {
  constexpr std::uint64_t kSeed = 91;
  SplitMix64 random(kSeed);
  for (int run = 0; run < 300; ++run) {
    const std::uint32_t points = 2 + random.Below(11);
    const auto edges = RandomEdges(points, static_cast<int>(random.Below(24)), random);
    const AmnProblem problem = RandomProblem(points, 2, edges, random);
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLabels labels, MaximizeScore(problem, Stop()));
    EXPECT_NEAR(labels.score, BestScoreByEnumeration(problem), 1e-9) << "run " << run;
    EXPECT_NEAR(labels.score, Score(problem, labels.labels), 1e-9);
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnRelaxation relaxed, RelaxScore(problem));
    EXPECT_NEAR(labels.score, relaxed.score, 1e-6) << "the relaxation is tight for two classes";
  }
}

TEST(AmnInferenceTest, ExpansionIsNearTheBestAndBelowTheRelaxation) {
  constexpr std::uint64_t kSeed = 92;
  SplitMix64 random(kSeed);
  int exact = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const std::uint32_t points = 2 + random.Below(8);
    const auto edges = RandomEdges(points, static_cast<int>(random.Below(18)), random);
    const AmnProblem problem = RandomProblem(points, 3, edges, random);
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLabels labels, MaximizeScore(problem, Stop()));
    const double best = BestScoreByEnumeration(problem);
    EXPECT_LE(labels.score, best + 1e-9);
    exact += labels.score > best - 1e-9 ? 1 : 0;
    double alone = 0.0;
    for (std::uint32_t i = 0; i < points; ++i) alone += problem.node_scores.row(i).maxCoeff();
    EXPECT_GE(labels.score, alone - 1e-9) << "no worse than the nodes' own labels";
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnRelaxation relaxed, RelaxScore(problem));
    EXPECT_GE(relaxed.score, best - 1e-6);
    for (std::uint32_t i = 0; i < points; ++i) EXPECT_NEAR(relaxed.share.row(i).sum(), 1.0, 1e-7);
  }
  RecordProperty("exact", exact);
  EXPECT_GE(exact, kRuns * 9 / 10);
}

// As an energy that is never negative: ½ w_e^k of every edge of a point goes to the point, and an
// edge between a ≠ b costs V = ½ (w_e^a + w_e^b), a metric.
double TopOfEnergy(const AmnProblem& problem) {
  ScoreMatrix node = problem.node_scores;
  for (const NetworkEdge& edge : problem.edges) {
    node.row(edge.i) += 0.5 * problem.edge_scores.transpose();
    node.row(edge.j) += 0.5 * problem.edge_scores.transpose();
  }
  return node.rowwise().maxCoeff().sum();
}

TEST(AmnInferenceTest, ExpansionKeepsItsBoundAndItsStart) {
  constexpr std::uint64_t kSeed = 93;
  SplitMix64 random(kSeed);
  int exact = 0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    SCOPED_TRACE(run);
    const int classes = 2 + run % 3;
    const std::uint32_t points = 6 + random.Below(7);
    const auto edges = RandomEdges(points, static_cast<int>(random.Below(28)), random);
    AmnProblem problem = RandomProblem(points, classes, edges, random);
    for (double& score : problem.edge_scores) score += 0.2;
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLabels labels, MaximizeScore(problem, Stop()));
    const double best = testing::BestScoreByBranching(problem);
    EXPECT_GE(labels.score, Score(problem, LargestScores(problem.node_scores)) - 1e-9);
    EXPECT_TRUE(classes > 2 || std::abs(labels.score - best) < 1e-9);
    exact += labels.score > best - 1e-9 ? 1 : 0;
    // Boykov, Veksler, Zabih 2001: within 2 max V / min V of the least energy.
    Eigen::VectorXd w = problem.edge_scores;
    std::sort(w.begin(), w.end());
    const double ratio = (w[w.size() - 1] + w[w.size() - 2]) / (w[0] + w[1]);
    const double top = TopOfEnergy(problem);
    EXPECT_GE(top - best, -1e-9);
    EXPECT_LE(top - labels.score, 2.0 * ratio * (top - best) + 1e-9);
  }
  RecordProperty("exact", exact);
}

TEST(AmnInferenceTest, BranchingIsEnumeration) {
  constexpr std::uint64_t kSeed = 94;
  SplitMix64 random(kSeed);
  for (int run = 0; run < 30; ++run) {
    const auto edges = RandomEdges(7, static_cast<int>(random.Below(18)), random);
    const AmnProblem problem = RandomProblem(7, 3, edges, random);
    EXPECT_NEAR(testing::BestScoreByBranching(problem), BestScoreByEnumeration(problem), 1e-9);
  }
}

TEST(AmnInferenceTest, NeighboursOutvoteNoise) {
  // A chain of twenty of which one is wrong by itself.
  std::vector<NetworkEdge> edges;
  for (std::uint32_t i = 0; i + 1 < 20; ++i) edges.push_back({i, i + 1});
  AmnProblem problem;
  problem.node_scores = ScoreMatrix::Zero(20, 3);
  problem.node_scores.col(1).setConstant(0.5);
  problem.node_scores(7, 2) = 1.0;
  problem.edge_scores = Eigen::Vector3d::Constant(0.4);
  problem.edges = edges;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLabels labels, MaximizeScore(problem, Stop()));
  EXPECT_THAT(labels.labels, ::testing::Each(1));
  EXPECT_GT(labels.sweeps, 0);
}

TEST(AmnInferenceTest, NothingToLabelAndAStop) {
  AmnProblem problem;
  problem.node_scores.resize(0, 3);
  problem.edge_scores = Eigen::Vector3d::Ones();
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLabels labels, MaximizeScore(problem, Stop()));
  EXPECT_TRUE(labels.labels.empty());
  problem.node_scores = ScoreMatrix::Ones(2, 3);
  Stop stop;
  stop.Request();
  EXPECT_THAT(MaximizeScore(problem, stop),
              testing::StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
