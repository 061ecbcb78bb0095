// Two classes beside dlib's structural_graph_labeling_trainer.
//
// dlib's model is the score of one class against the other, and a price w' of every edge between
// different labels: with w_n^1 = −w_n^0 and w_e^0 = w_e^1 ours is the same, w_n^1 − w_n^0 = v and
// w_e = w'. Such weights are learned from a network beside its own mirror image, features negated
// and labels exchanged. Then ½ |w|² is ½ (|v|² / 2 + 2 w'²), which dlib's ½ (|v|² + w'²) becomes
// when its node vectors are √2 and its edge vectors 1/√2 times ours.
#include <cmath>
#include <cstdint>
#include <vector>

#include <dlib/svm_threaded.h>
#include <gtest/gtest.h>

#include "core/classification/amn/amn_inference.h"
#include "tests/core/classification/amn/chains.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::Chain;
using Vector = dlib::matrix<double, 0, 1>;
using Graph = dlib::graph<Vector, Vector>::kernel_1a_c;

// Features without the constant, by which a mirror image differs.
Chain MakeSigned(std::uint32_t points, std::uint64_t seed) {
  Chain chain = testing::MakeChain(points, 2, 1.6, seed);
  chain.features.col(1) -= chain.features.col(2).eval();
  chain.features.col(0).setConstant(0.0F);
  SplitMix64 random(seed + 1000);
  for (std::uint32_t i = 0; i < points; ++i) {
    chain.features(i, 2) = static_cast<float>(testing::RandomIn(-1.0, 1.0, random));
  }
  return chain;
}

Chain WithMirrorImage(const Chain& chain) {
  Chain both = chain;
  const auto n = static_cast<std::uint32_t>(chain.labels.size());
  both.features.conservativeResize(2 * n, Eigen::NoChange);
  both.features.bottomRows(n) = -chain.features;
  for (const ClassIndex label : chain.labels) both.labels.push_back(label == 0 ? 1 : 0);
  for (const NetworkEdge& edge : chain.edges) both.edges.push_back({n + edge.i, n + edge.j});
  return both;
}

void MakeGraph(const Chain& chain, Graph& graph) {
  graph.set_number_of_nodes(chain.labels.size());
  for (std::size_t i = 0; i < chain.labels.size(); ++i) {
    Vector& x = graph.node(i).data;
    x.set_size(chain.features.cols());
    for (Eigen::Index f = 0; f < chain.features.cols(); ++f) {
      x(f) = std::sqrt(2.0) * chain.features(static_cast<Eigen::Index>(i), f);
    }
  }
  for (const NetworkEdge& edge : chain.edges) {
    graph.add_edge(edge.i, edge.j);
    Vector one(1);
    one = std::sqrt(0.5);
    dlib::edge(graph, edge.i, edge.j) = one;
  }
}

dlib::graph_labeler<Vector> TrainPeer(const Chain& chain, double c) {
  dlib::array<Graph> graphs(1);
  MakeGraph(chain, graphs[0]);
  std::vector<bool> labels;
  for (const ClassIndex label : chain.labels) labels.push_back(label == 1);
  dlib::structural_graph_labeling_trainer<Vector> trainer;
  trainer.set_c(c);
  trainer.set_epsilon(1e-4);
  trainer.set_num_threads(1);
  return trainer.train(graphs, std::vector<std::vector<bool>>{labels});
}

AmnWeights FromPeer(const dlib::graph_labeler<Vector>& peer) {
  AmnWeights weights;
  const Vector& v = peer.get_node_weights();
  weights.node.resize(2, v.size());
  for (long f = 0; f < v.size(); ++f) {
    weights.node(1, f) = std::sqrt(0.5) * v(f);  // half of √2 v
    weights.node(0, f) = -weights.node(1, f);
  }
  weights.edge = Eigen::Vector2d::Constant(std::sqrt(0.5) * peer.get_edge_weights()(0));
  return weights;
}

// ½ |w|² + c ξ; the most violated labeling is exact for two classes.
double Objective(const Chain& chain, const AmnWeights& weights, double c) {
  const AmnLabels worst = MaximizeScore(testing::AugmentedProblem(chain, weights), Stop()).value();
  const double right = Score(MakeAmnProblem(weights, chain.features, chain.edges), chain.labels);
  return 0.5 * (weights.node.squaredNorm() + weights.edge.squaredNorm()) +
         c * (worst.score - right);
}

TEST(AmnPeerTest, TwoClassesLearnAndLabelLikeDlib) {
  constexpr double kSlackWeight = 30.0;
  for (std::uint64_t seed = 31; seed <= 34; ++seed) {
    SCOPED_TRACE(seed);
    const Chain chain = MakeSigned(300, seed);
    const double c = kSlackWeight / 300.0;
    const dlib::graph_labeler<Vector> peer = TrainPeer(chain, c);
    const AmnWeights theirs = FromPeer(peer);
    // c · 2N points, and the slack of both images is twice that of one.
    const AmnLearningOptions options{.slack_weight = kSlackWeight, .tolerance = 1e-6};
    STRATA_ASSERT_OK_AND_ASSIGN(
        const AmnLearning ours,
        LearnByCuttingPlanes(WithMirrorImage(chain).set(), options, Stop()));
    ASSERT_TRUE(ours.converged);
    EXPECT_NEAR(ours.weights.edge[0], ours.weights.edge[1], 1e-2 * ours.weights.edge[0]);
    EXPECT_GT(ours.weights.edge[0], 0.0);
    const double objective = Objective(chain, ours.weights, c);
    EXPECT_NEAR(objective, ours.objective, 1e-3 * objective) << "the mirror image adds nothing";
    EXPECT_NEAR(objective, Objective(chain, theirs, c), 1e-3 * objective);

    const Chain test = MakeSigned(2000, seed + 100);
    Graph graph;
    MakeGraph(test, graph);
    const std::vector<bool> labels = peer(graph);
    STRATA_ASSERT_OK_AND_ASSIGN(
        const AmnLabels found,
        MaximizeScore(MakeAmnProblem(ours.weights, test.features, test.edges), Stop()));
    std::size_t equal = 0, right = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      equal += (found.labels[i] == 1) == labels[i] ? 1 : 0;
      right += found.labels[i] == test.labels[i] ? 1 : 0;
    }
    EXPECT_GE(equal, labels.size() * 99 / 100);
    EXPECT_GT(right, labels.size() * 3 / 4) << "there was something to learn";
    // The same weights: the same labels.
    STRATA_ASSERT_OK_AND_ASSIGN(
        const AmnLabels same,
        MaximizeScore(MakeAmnProblem(theirs, test.features, test.edges), Stop()));
    equal = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      equal += (same.labels[i] == 1) == labels[i] ? 1 : 0;
    }
    EXPECT_EQ(equal, labels.size());
  }
}

}  // namespace
}  // namespace strata
