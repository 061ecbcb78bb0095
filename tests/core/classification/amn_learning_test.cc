#include "core/classification/amn_learning.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/classification/amn_inference.h"
#include "tests/core/classification/random_networks.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

// Points along a way whose class changes now and then; features say it with noise.
struct Chain {
  FeatureMatrix features;
  std::vector<NetworkEdge> edges;
  std::vector<ClassIndex> labels;
  std::size_t classes = 0;

  AmnTrainingSet set() const { return {features, edges, labels, classes}; }
};

Chain MakeChain(std::uint32_t points, std::size_t classes, double noise, std::uint64_t seed) {
  SplitMix64 random(seed);
  Chain chain;
  chain.classes = classes;
  chain.features = FeatureMatrix::Zero(points, static_cast<Eigen::Index>(classes) + 1);
  ClassIndex label = 0;
  for (std::uint32_t i = 0; i < points; ++i) {
    if (i % 7 == 0)
      label = static_cast<ClassIndex>(random.Below(static_cast<std::uint32_t>(classes)));
    chain.labels.push_back(label);
    chain.features(i, 0) = 1.0F;
    chain.features(i, 1 + label) = 1.0F;
    for (std::size_t k = 0; k < classes; ++k) {
      chain.features(i, 1 + static_cast<Eigen::Index>(k)) +=
          static_cast<float>(testing::RandomIn(-noise, noise, random));
    }
    if (i > 0) chain.edges.push_back({i - 1, i});
    if (i > 2 && random.Below(2) == 0) chain.edges.push_back({i - 3, i});
  }
  return chain;
}

// ½ |w|² + c ξ by enumeration of all labelings.
double ObjectiveByEnumeration(const Chain& chain, const AmnWeights& weights, double slack_weight) {
  AmnProblem problem = MakeAmnProblem(weights, chain.features, chain.edges);
  const double right = Score(problem, chain.labels);
  problem.node_scores.array() += 1.0;
  for (std::size_t i = 0; i < chain.labels.size(); ++i) {
    problem.node_scores(static_cast<Eigen::Index>(i), chain.labels[i]) -= 1.0;
  }
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

TEST(AmnLearningTest, MoreClassesAgreeUnderTheRelaxation) {
  const Chain chain = MakeChain(60, 3, 1.0, 5);
  AmnLearningOptions options;
  options.slack_weight = 30.0;
  options.tolerance = 1e-5;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning program,
                              LearnByQuadraticProgram(chain.set(), options));
  options.relaxed = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning relaxed,
                              LearnByCuttingPlanes(chain.set(), options, Stop()));
  EXPECT_NEAR(relaxed.objective, program.objective, 1e-4 * program.objective);
  // α-expansion overlooks planes: its objective is no more than that of the relaxation.
  options.relaxed = false;
  STRATA_ASSERT_OK_AND_ASSIGN(const AmnLearning expanded,
                              LearnByCuttingPlanes(chain.set(), options, Stop()));
  EXPECT_LE(expanded.lower_bound, program.objective * (1.0 + 1e-4));
  RecordProperty("gap_ppm", static_cast<int>(1e6 * (1.0 - expanded.objective / program.objective)));
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
