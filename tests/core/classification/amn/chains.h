// Points along a way, with their network, for tests of learning.
#ifndef STRATA_TESTS_CORE_CLASSIFICATION_AMN_CHAINS_H_
#define STRATA_TESTS_CORE_CLASSIFICATION_AMN_CHAINS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/classification/amn/amn_learning.h"
#include "tests/core/classification/amn/random_networks.h"

namespace strata::testing {

struct Chain {
  FeatureMatrix features;
  std::vector<NetworkEdge> edges;
  std::vector<ClassIndex> labels;
  std::size_t classes = 0;

  AmnTrainingSet set() const { return {features, edges, labels, classes}; }
};

// The class changes now and then; features say it with noise.
inline Chain MakeChain(std::uint32_t points,
                       std::size_t classes,
                       double noise,
                       std::uint64_t seed) {
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
          static_cast<float>(RandomIn(-noise, noise, random));
    }
    if (i > 0) chain.edges.push_back({i - 1, i});
    if (i > 2 && random.Below(2) == 0) chain.edges.push_back({i - 3, i});
  }
  return chain;
}

// Scores of `chain` that also count wrong labels.
inline AmnProblem AugmentedProblem(const Chain& chain, const AmnWeights& weights) {
  AmnProblem problem = MakeAmnProblem(weights, chain.features, chain.edges);
  problem.node_scores.array() += 1.0;
  for (std::size_t i = 0; i < chain.labels.size(); ++i) {
    problem.node_scores(static_cast<Eigen::Index>(i), chain.labels[i]) -= 1.0;
  }
  return problem;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CLASSIFICATION_AMN_CHAINS_H_
