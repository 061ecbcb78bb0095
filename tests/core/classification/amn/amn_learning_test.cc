#include "core/classification/amn/amn_learning.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/amn/amn_inference.h"
#include "tests/core/classification/amn/chains.h"
#include "tests/core/classification/amn/quadratic_program.h"
#include "tests/core/classification/amn/relaxation.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::AmnRelaxation;
using testing::Chain;
using testing::LearnByQuadraticProgram;
using testing::MakeChain;
using testing::RelaxScore;

double HalfNorm(const AmnWeights& w) {
  return 0.5 * (w.node.squaredNorm() + w.edge.cwiseMax(0.0).squaredNorm());
}

// ½ |w|² + c ξ by enumeration of all labelings.
double ObjectiveByEnumeration(const Chain& chain, const AmnWeights& weights, double slack_weight) {
  const double right = Score(MakeAmnProblem(weights, chain.features, chain.edges), chain.labels);
  const AmnProblem problem = testing::AugmentedProblem(chain, weights);
  const double slack = testing::BestScoreByEnumeration(problem) - right;
  return 0.5 * (weights.node.squaredNorm() + weights.edge.squaredNorm()) +
         slack_weight / static_cast<double>(chain.labels.size()) * slack;
}

TEST(AmnLearningTest, BothWaysFindTheLeastObjectiveOfTwoClasses) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const Chain chain = MakeChain(12, 2, 1.2, seed);
    AmnLearningOptions options;
    options.slack_weight = 20.0;
    options.tolerance = 1e-6;
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning program,
                                LearnByQuadraticProgram(chain.set(), options));
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning planes,
                                LearnByCuttingPlanes(chain.set(), options, Stop()));
    ASSERT_TRUE(planes.converged);
    EXPECT_NEAR(planes.objective, program.objective, 1e-4 * program.objective);
    EXPECT_NEAR(planes.objective,
                ObjectiveByEnumeration(chain, planes.weights, options.slack_weight),
                1e-6 * planes.objective);
    EXPECT_NEAR(program.objective,
                ObjectiveByEnumeration(chain, program.weights, options.slack_weight),
                1e-4 * program.objective);
    EXPECT_GE(planes.weights.edge.minCoeff(), 0.0);
    EXPECT_LE((planes.weights.node - program.weights.node).norm(),
              1e-2 * program.weights.node.norm());
  }
}

// α-expansion overlooks planes of more classes, so that it finds no more than the program.
TEST(AmnLearningTest, MoreClassesAreLearnedNearTheProgram) {
  const Chain chain = MakeChain(60, 3, 1.0, 5);
  AmnLearningOptions options;
  options.slack_weight = 30.0;
  options.tolerance = 1e-5;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning program,
                              LearnByQuadraticProgram(chain.set(), options));
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning planes,
                              LearnByCuttingPlanes(chain.set(), options, Stop()));
  EXPECT_LE(planes.lower_bound, program.objective * (1.0 + 1e-4));
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnRelaxation worst,
                              RelaxScore(testing::AugmentedProblem(chain, planes.weights)));
  const AmnProblem plain = MakeAmnProblem(planes.weights, chain.features, chain.edges);
  const double slack = worst.score - Score(plain, chain.labels);
  const double relaxed = HalfNorm(planes.weights) + 30.0 / 60.0 * slack;
  EXPECT_GE(relaxed, program.objective * (1.0 - 1e-4));
  EXPECT_LE(relaxed, program.objective * 1.02);
}

// Rows that stand for one, two or three points of a chain.
struct Rows {
  Chain of_rows;
  Chain of_points;
  std::vector<std::uint32_t> row_of, counts, inner_edges;

  AmnTrainingSet set() const {
    return {of_rows.features, of_rows.edges, of_rows.labels, 2, counts, inner_edges};
  }
  // ½ |w|² + c ξ over all labelings of the points that give those of one row one label.
  double ObjectiveByEnumeration(const AmnWeights& weights, double slack_weight) const {
    const AmnProblem problem = testing::AugmentedProblem(of_points, weights);
    double best = -1e300;
    for (std::uint32_t bits = 0; bits < (1U << counts.size()); ++bits) {
      std::vector<ClassIndex> labels;
      for (const std::uint32_t row : row_of) labels.push_back((bits >> row) & 1U);
      best = std::max(best, Score(problem, labels));
    }
    const AmnProblem plain = MakeAmnProblem(weights, of_points.features, of_points.edges);
    const double slack = best - Score(plain, of_points.labels);
    return 0.5 * (weights.node.squaredNorm() + weights.edge.squaredNorm()) +
           slack_weight / static_cast<double>(row_of.size()) * slack;
  }
};

Rows MakeRows(std::uint64_t seed) {
  Rows rows;
  rows.of_rows = MakeChain(9, 2, 1.2, seed);
  rows.of_points.classes = 2;
  for (std::uint32_t row = 0; row < 9; ++row) {
    rows.counts.push_back(1 + row % 3);
    rows.row_of.insert(rows.row_of.end(), rows.counts.back(), row);
  }
  rows.of_points.features = rows.of_rows.features(rows.row_of, Eigen::all);
  for (std::uint32_t i = 0; i < rows.row_of.size(); ++i) {
    rows.of_points.labels.push_back(rows.of_rows.labels[rows.row_of[i]]);
    for (std::uint32_t j = i + 1; j < std::min<std::size_t>(i + 4, rows.row_of.size()); ++j) {
      rows.of_points.edges.push_back({i, j});
    }
  }
  ContractedNetwork network = Contract(rows.of_points.edges, rows.row_of, 9);
  rows.of_rows.edges = std::move(network.edges);
  rows.inner_edges = std::move(network.inner_edges);
  return rows;
}

TEST(AmnLearningTest, RowsThatStandForPointsAreLearnedAsThosePoints) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Rows rows = MakeRows(seed);
    AmnLearningOptions options;
    options.slack_weight = 20.0;
    options.tolerance = 1e-6;
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning program,
                                LearnByQuadraticProgram(rows.set(), options));
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning planes,
                                LearnByCuttingPlanes(rows.set(), options, Stop()));
    EXPECT_NEAR(planes.objective, program.objective, 1e-4 * program.objective);
    EXPECT_NEAR(planes.objective,
                rows.ObjectiveByEnumeration(planes.weights, options.slack_weight),
                1e-5 * planes.objective);
  }
}

// The optimality conditions of the margin problem in its own variables: a small step in any
// direction that keeps w_e ≥ 0 raises the objective.
TEST(AmnLearningTest, NoStepFromTheLeastObjectiveGains) {
  const Chain chain = MakeChain(10, 2, 1.0, 9);
  AmnLearningOptions options;
  options.slack_weight = 15.0;
  options.tolerance = 1e-8;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning learning,
                              LearnByCuttingPlanes(chain.set(), options, Stop()));
  const double least = ObjectiveByEnumeration(chain, learning.weights, options.slack_weight);
  SplitMix64 random(17);
  for (int run = 0; run < 50; ++run) {
    AmnWeights moved = learning.weights;
    for (double& w : moved.node.reshaped()) w += testing::RandomIn(-0.02, 0.02, random);
    for (double& w : moved.edge) w = std::max(0.0, w + testing::RandomIn(-0.02, 0.02, random));
    EXPECT_GE(ObjectiveByEnumeration(chain, moved, options.slack_weight), least * (1.0 - 1e-6));
  }
}

// Shares y of eq. 9.8 and the weights that go with them: w_n^k = c Σ_i (ŷ_i^k − y_i^k) x_i, w_e^k =
// max(0, c Σ_ij (ŷ_ij^k − y_ij^k)): stationarity of eq. 9.7, whose multipliers c y are.
struct Multipliers {
  AmnWeights weights;  // before the max
  double loss = 0.0;   // Σ_i (1 − y_i of the right class)
};

Multipliers MultipliersOf(const Chain& chain, const AmnRelaxation& shares, double c) {
  Multipliers result;
  ScoreMatrix node = -shares.share;
  ScoreMatrix edge = -shares.edge_share;
  for (Eigen::Index i = 0; i < node.rows(); ++i) {
    const ClassIndex right = chain.labels[static_cast<std::size_t>(i)];
    result.loss += 1.0 - shares.share(i, right);
    node(i, right) += 1.0;
  }
  for (Eigen::Index e = 0; e < edge.rows(); ++e) {
    const NetworkEdge& ends = chain.edges[static_cast<std::size_t>(e)];
    if (chain.labels[ends.i] == chain.labels[ends.j]) edge(e, chain.labels[ends.i]) += 1.0;
  }
  result.weights.node = c * node.transpose() * chain.features.cast<double>();
  result.weights.edge = c * edge.colwise().sum().transpose();
  return result;
}

// The dual of eq. 9.7, c · loss − ½ |w|², climbed by steps towards what the linear program says
// (Frank, Wolfe 1956).
Multipliers ClimbDual(const Chain& chain, double c, int steps) {
  AmnWeights zero;
  zero.node =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(chain.classes), chain.features.cols());
  zero.edge = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(chain.classes));
  Multipliers at{zero};
  for (int step = 0; step < steps; ++step) {
    AmnWeights w = at.weights;
    w.edge = w.edge.cwiseMax(0.0);
    const Multipliers to =
        MultipliersOf(chain, RelaxScore(testing::AugmentedProblem(chain, w)).value(), c);
    Multipliers best = at;
    double highest = -1e300;
    for (int k = 0; k <= 64; ++k) {  // on a line, finer and finer towards where it stands
      const double share = std::pow(k / 64.0, 3);
      Multipliers tried;
      tried.weights.node = (1.0 - share) * at.weights.node + share * to.weights.node;
      tried.weights.edge = (1.0 - share) * at.weights.edge + share * to.weights.edge;
      tried.loss = (1.0 - share) * at.loss + share * to.loss;
      const double dual = c * tried.loss - HalfNorm(tried.weights);
      if (dual <= highest) continue;
      highest = dual;
      best = std::move(tried);
    }
    at = std::move(best);
  }
  return at;
}

TEST(AmnLearningTest, TheQuadraticProgramMeetsItsOptimalityConditions) {
  for (const std::size_t classes : {2U, 3U}) {
    SCOPED_TRACE(classes);
    const Chain chain = MakeChain(16, classes, 1.0, 40 + classes);
    const AmnLearningOptions options{.slack_weight = 12.0, .tolerance = 1e-6};
    const double c = options.slack_weight / 16.0;
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning program,
                                LearnByQuadraticProgram(chain.set(), options));
    const AmnWeights& w = program.weights;
    // Primal feasibility: w_e ≥ 0, and ξ is what the relaxed best labeling is ahead.
    EXPECT_GE(w.edge.minCoeff(), 0.0);
    STRATA_ASSERT_OK_AND_ASSIGN(const AmnRelaxation worst,
                                RelaxScore(testing::AugmentedProblem(chain, w)));
    const double slack =
        worst.score - Score(MakeAmnProblem(w, chain.features, chain.edges), chain.labels);
    EXPECT_NEAR(program.objective, HalfNorm(w) + c * slack, 1e-5 * program.objective);
    // Multipliers, found without the solver: strong duality, hence complementary slackness.
    const Multipliers dual = ClimbDual(chain, c, 2000);
    EXPECT_NEAR(
        c * dual.loss - HalfNorm(dual.weights), program.objective, 2e-3 * program.objective);
    EXPECT_LE(c * dual.loss - HalfNorm(dual.weights), program.objective * (1.0 + 1e-5));
    // Stationarity.
    EXPECT_LE((dual.weights.node - w.node).norm(), 0.06 * w.node.norm());
    EXPECT_LE((dual.weights.edge.cwiseMax(0.0) - w.edge).norm(), 0.06 * w.node.norm());
  }
}

TEST(AmnLearningTest, NeighboursAreWorthSomethingWhereFeaturesAreNoisy) {
  const Chain train = MakeChain(600, 3, 1.5, 21);
  const Chain test = MakeChain(600, 3, 1.5, 22);
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning learning,
                              LearnByCuttingPlanes(train.set(), {}, Stop()));
  EXPECT_GT(learning.weights.edge.minCoeff(), 0.0);
  const auto wrong = [&test](const AmnWeights& weights) {
    const AmnLabels labels =
        MaximizeScore(MakeAmnProblem(weights, test.features, test.edges), Stop()).value();
    int count = 0;
    for (std::size_t i = 0; i < test.labels.size(); ++i) {
      count += labels.labels[i] != test.labels[i] ? 1 : 0;
    }
    return count;
  };
  AmnWeights alone = learning.weights;
  alone.edge.setZero();
  EXPECT_LT(wrong(learning.weights), 2 * wrong(alone) / 3);
}

TEST(AmnLearningTest, RefusesOptionsAndStops) {
  const Chain chain = MakeChain(10, 2, 1.0, 9);
  AmnLearningOptions options;
  options.slack_weight = 0.0;
  EXPECT_THAT(
      LearnByCuttingPlanes(chain.set(), options, Stop()),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("slack_weight")));
  EXPECT_THAT(
      LearnByQuadraticProgram(chain.set(), options),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("slack_weight")));
  Stop stop;
  stop.Request();
  EXPECT_THAT(LearnByCuttingPlanes(chain.set(), {}, stop),
              testing::StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
