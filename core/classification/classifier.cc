#include "core/classification/classifier.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/amn/amn_inference.h"
#include "core/classification/features/instance_features.h"
#include "core/classification/learners/instances.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr ClassifierMethod kMethods[] = {ClassifierMethod::kBayes,
                                         ClassifierMethod::kNearest,
                                         ClassifierMethod::kAdaBoost,
                                         ClassifierMethod::kAmn,
                                         ClassifierMethod::kInstanceAmn};

absl::StatusOr<ClassifiedCloud> Infer(const AmnWeights& weights,
                                      const FeatureMatrix& features,
                                      const std::vector<NetworkEdge>& edges,
                                      const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(AmnLabels found,
                          MaximizeScore(MakeAmnProblem(weights, features, edges), stop));
  return ClassifiedCloud{std::move(found.labels), found.score};
}

// Neighbours of points that are none are none: they keep their place, far from all others.
std::vector<NetworkEdge> NetworkOfFinite(const PointCloud& cloud, const NetworkOptions& options) {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    points.push_back(cloud.points[i]);
    rows.push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<NetworkEdge> edges = DrawNetwork(points, options);
  for (NetworkEdge& edge : edges) edge = {rows[edge.i], rows[edge.j]};
  return edges;
}

}  // namespace

absl::string_view ToString(ClassifierMethod method) {
  switch (method) {
    case ClassifierMethod::kBayes:
      return "bayes";
    case ClassifierMethod::kNearest:
      return "knn";
    case ClassifierMethod::kAdaBoost:
      return "adaboost";
    case ClassifierMethod::kAmn:
      return "amn";
    case ClassifierMethod::kInstanceAmn:
      return "iamn";
  }
  return "unknown";
}

absl::StatusOr<ClassifierMethod> ClassifierMethodFromName(absl::string_view name) {
  for (const ClassifierMethod method : kMethods) {
    if (name == ToString(method)) return method;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "method '", name.substr(0, 100), "' is none of bayes, knn, adaboost, amn, iamn"));
}

absl::Status TrainingOptions::Validate() const {
  STRATA_RETURN_IF_ERROR(features.Validate());
  STRATA_RETURN_IF_ERROR(reduction.Validate());
  STRATA_RETURN_IF_ERROR(network.Validate());
  OptionChecks checks("training options");
  checks.InRange("slack_weight", slack_weight, 1e-12, 1e12);
  checks.InRange("neighbours", neighbours, 1, 100);
  checks.InRange("rounds", rounds, 1, 10000);
  return checks.status();
}

FeatureMatrix Standardised(const Classifier& classifier, FeatureMatrix features) {
  features.rowwise() -= classifier.feature_mean;
  features.array().rowwise() *= classifier.feature_scale.array();
  return features;
}

absl::StatusOr<ClassifiedCloud> Classify(const Classifier& classifier,
                                         const PointCloud& cloud,
                                         const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(FeatureMatrix raw, ComputeFeatures(cloud, classifier.features, stop));
  const FeatureMatrix features = Standardised(classifier, std::move(raw));
  if (const auto* bayes = std::get_if<NaiveBayes>(&classifier.model)) {
    return ClassifiedCloud{LargestScores(NaiveBayesScores(*bayes, features))};
  }
  if (const auto* boosted = std::get_if<AdaBoost>(&classifier.model)) {
    return ClassifiedCloud{AdaBoostLabels(*boosted, features)};
  }
  if (const auto* weights = std::get_if<AmnWeights>(&classifier.model)) {
    return Infer(*weights, features, NetworkOfFinite(cloud, classifier.network), stop);
  }
  const auto& kept = std::get<InstanceModel>(classifier.model);
  const Instances instances(kept.instances);
  const auto count = static_cast<std::size_t>(kept.neighbours);
  if (classifier.method == ClassifierMethod::kNearest) {
    return ClassifiedCloud{LargestScores(instances.Votes(features, count))};
  }
  return Infer(kept.weights,
               InstanceFeatures(instances.Distances(features, count)),
               NetworkOfFinite(cloud, classifier.network),
               stop);
}

}  // namespace strata
