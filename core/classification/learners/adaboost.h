// AdaBoost on thresholds of single features (thesis 8.5, Algorithm 5), several classes in sequence
// (8.5.1).
#ifndef STRATA_CORE_CLASSIFICATION_LEARNERS_ADABOOST_H_
#define STRATA_CORE_CLASSIFICATION_LEARNERS_ADABOOST_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"

#include "core/classification/features/labelled_features.h"
#include "core/common/stop.h"

namespace strata {

// A weak classifier: +1 where sign · (x[feature] − threshold) > 0, else −1, with its weight α_t.
struct Stump {
  std::size_t feature = 0;
  float threshold = 0.0F;
  float sign = 1.0F;  // +1 or −1
  double weight = 0.0;
};

// One class against the others that are left.
struct BoostedClass {
  ClassIndex label = 0;
  std::vector<Stump> stumps;
};

// Classes in the order in which they are asked; the last is what nobody else claims.
struct AdaBoost {
  std::vector<BoostedClass> sequence;  // all classes but `rest`
  ClassIndex rest = 0;
};

struct AdaBoostOptions {
  int rounds = 100;  // weak classifiers a class, at most; in [1, 10000]
};

// Classes that are told apart best come first. A class's rounds end early once a weak classifier
// is right everywhere (its weight is bounded) or no better than chance. INVALID_ARGUMENT for data
// that Validate() refuses.
absl::StatusOr<AdaBoost> LearnAdaBoost(const LabelledFeatures& data,
                                       const AdaBoostOptions& options,
                                       const Stop& stop);

std::vector<ClassIndex> AdaBoostLabels(const AdaBoost& model, const FeatureMatrix& features);

// Features by the weight that they have in all, largest first; those of weight zero left out.
std::vector<std::size_t> FeaturesByWeight(const AdaBoost& model);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_LEARNERS_ADABOOST_H_
