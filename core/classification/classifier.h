// A trained classifier, whatever its method: labels clouds. See training.h for how one is learned.
#ifndef STRATA_CORE_CLASSIFICATION_CLASSIFIER_H_
#define STRATA_CORE_CLASSIFICATION_CLASSIFIER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/classification/amn/amn.h"
#include "core/classification/amn/network.h"
#include "core/classification/features/features.h"
#include "core/classification/features/labelled_features.h"
#include "core/classification/learners/adaboost.h"
#include "core/classification/learners/naive_bayes.h"
#include "core/classification/reduction.h"
#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"

namespace strata {

enum class ClassifierMethod : std::uint8_t {  // stored
  kBayes = 1,
  kNearest = 2,
  kAdaBoost = 3,
  kAmn = 4,
  kInstanceAmn = 5,
};

// "bayes", "knn", "adaboost", "amn", "iamn".
absl::string_view ToString(ClassifierMethod method);
absl::StatusOr<ClassifierMethod> ClassifierMethodFromName(absl::string_view name);

// A class as the clouds that were learned from name it.
struct ClassName {
  std::uint16_t id = 0;  // PointCloud::label; never 0
  std::string name;
  friend bool operator==(const ClassName&, const ClassName&) = default;
};

struct TrainingOptions {
  ClassifierMethod method = ClassifierMethod::kAmn;
  PointFeatureOptions features;
  ReductionOptions reduction;
  NetworkOptions network;
  double slack_weight = 100.0;  // of AmnLearningOptions
  int neighbours = 5;           // instances a class: M of eq. 9.9, l of eq. 8.5; in [1, 100]
  int rounds = 100;             // of AdaBoost, in [1, 10000]

  absl::Status Validate() const;
};

// Instances that a model keeps, with what weighs their distances.
struct InstanceModel {
  LabelledFeatures instances;
  int neighbours = 5;
  AmnWeights weights;  // kInstanceAmn only
};

// Plain values; see classifier_codec.h for their bytes.
struct Classifier {
  ClassifierMethod method = ClassifierMethod::kAmn;
  std::vector<ClassName> classes;  // by ClassIndex
  PointFeatureOptions features;
  NetworkOptions network;
  // Features are taken to mean 0 and variance 1 of the training points (but the constant), so that
  // no unit decides what counts.
  Eigen::RowVectorXf feature_mean;
  Eigen::RowVectorXf feature_scale;
  std::variant<AmnWeights, InstanceModel, NaiveBayes, AdaBoost> model;
  std::uint64_t points_seen = 0;  // labelled points that were learned from
  std::uint64_t points_kept = 0;  // after reduction
};

// What a cloud's points are.
struct ClassifiedCloud {
  std::vector<ClassIndex> labels;  // of every point
  double score = 0.0;              // of networks: what inference reached
};

// Features as the model sees them.
FeatureMatrix Standardised(const Classifier& classifier, FeatureMatrix features);

// Deterministic. Points that are not finite get what their constant feature says.
absl::StatusOr<ClassifiedCloud> Classify(const Classifier& classifier,
                                         const PointCloud& cloud,
                                         const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_CLASSIFIER_H_
