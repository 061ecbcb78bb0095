// Nearest neighbour, networks and instance-based networks on places (thesis 9.4.4), learned on one
// part of a building and asked about another.
#ifndef STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_PLACE_METHODS_H_
#define STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_PLACE_METHODS_H_

#include <cstdint>
#include <vector>

#include "core/classification/amn/network.h"
#include "core/classification/features/labelled_features.h"

namespace strata::testing {

enum Method { kNearest, kAmn, kInstanceAmn };
inline constexpr const char* kMethodNames[] = {"NN", "AMN", "iAMN"};

// Cells with the features of what is seen from them.
struct Wing {
  LabelledFeatures data;
  std::vector<NetworkEdge> edges;
};

// Columns of features, and what takes them to mean 0 and variance 1.
struct FeatureChoice {
  std::vector<std::uint32_t> columns;
  Eigen::RowVectorXf mean;
  Eigen::RowVectorXf deviation;
};

// Those that boosting on the wing finds most useful, `most` of them.
FeatureChoice ChooseFeatures(const Wing& training, std::size_t most);
void Apply(const FeatureChoice& choice, Wing& wing);

FeatureMatrix WithConstant(FeatureMatrix features);

// What the method, learned from `training`, calls the cells of `test`. Errors end the program.
std::vector<ClassIndex> LabelPlaces(const Wing& training, const Wing& test, Method method);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_PLACE_METHODS_H_
