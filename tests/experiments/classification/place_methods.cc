#include "tests/experiments/classification/place_methods.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/classification/amn/amn_inference.h"
#include "core/classification/amn/amn_learning.h"
#include "core/classification/features/instance_features.h"
#include "core/classification/learners/adaboost.h"
#include "core/classification/learners/instances.h"
#include "core/common/stop.h"
#include "tests/experiments/classification/classification_cases.h"

namespace strata::testing {
namespace {

template <typename T>
T Required(absl::StatusOr<T> result) {
  if (result.ok()) return *std::move(result);
  std::fprintf(stderr, "%s\n", result.status().ToString().c_str());
  std::exit(2);
}

std::vector<ClassIndex> LearnAndLabel(const Wing& training,
                                      const FeatureMatrix& training_features,
                                      const Wing& test,
                                      const FeatureMatrix& test_features) {
  const AmnLearning learned = Required(LearnByCuttingPlanes(
      {training_features, training.edges, training.data.labels, training.data.classes},
      {.tolerance = 1e-3},
      Stop()));
  return Required(MaximizeScore(MakeAmnProblem(learned.weights, test_features, test.edges), Stop()))
      .labels;
}

}  // namespace

FeatureChoice ChooseFeatures(const Wing& training, std::size_t most) {
  const AdaBoost boosted = Required(LearnAdaBoost(training.data, {.rounds = 100}, Stop()));
  FeatureChoice choice;
  for (const std::size_t column : FeaturesByWeight(boosted)) {
    if (choice.columns.size() < most) choice.columns.push_back(static_cast<std::uint32_t>(column));
  }
  const FeatureMatrix chosen = training.data.features(Eigen::all, choice.columns);
  choice.mean = chosen.colwise().mean();
  choice.deviation =
      ((chosen.rowwise() - choice.mean).colwise().squaredNorm() / static_cast<float>(chosen.rows()))
          .cwiseSqrt()
          .cwiseMax(1e-6F);
  return choice;
}

void Apply(const FeatureChoice& choice, Wing& wing) {
  FeatureMatrix features = wing.data.features(Eigen::all, choice.columns);
  features.rowwise() -= choice.mean;
  features.array().rowwise() /= choice.deviation.array();
  wing.data.features = std::move(features);
}

FeatureMatrix WithConstant(FeatureMatrix features) {
  features.conservativeResize(Eigen::NoChange, features.cols() + 1);
  features.rightCols(1).setOnes();
  return features;
}

std::vector<ClassIndex> LabelPlaces(const Wing& training, const Wing& test, Method method) {
  const Instances instances(training.data);
  if (method == kNearest) {
    return LargestScores(instances.Votes(test.data.features, kNearestNeighbours));
  }
  if (method == kAmn) {
    return LearnAndLabel(
        training, WithConstant(training.data.features), test, WithConstant(test.data.features));
  }
  return LearnAndLabel(
      training,
      InstanceFeatures(instances.DistancesWithin(kInstanceNeighbours)),
      test,
      InstanceFeatures(instances.Distances(test.data.features, kInstanceNeighbours)));
}

}  // namespace strata::testing
