#include "core/classification/validation.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint64_t kFoldSeed = 1;

}  // namespace

absl::StatusOr<ConfusionMatrix> EvaluateClassifier(const Classifier& classifier,
                                                   const PointCloud& cloud,
                                                   const std::vector<ClassName>& classes,
                                                   const Stop& stop) {
  std::map<std::uint16_t, ClassIndex> place;  // of class ids
  for (const ClassName& name : classes) place[name.id] = static_cast<ClassIndex>(place.size());
  STRATA_ASSIGN_OR_RETURN(const ClassifiedCloud given, Classify(classifier, cloud, stop));
  ConfusionMatrix confusion(classes.size());
  for (std::size_t i = 0; i < cloud.label.size(); ++i) {
    const auto truth = place.find(cloud.label[i]);
    if (truth == place.end()) continue;
    confusion.Add(truth->second, place.at(classifier.classes[given.labels[i]].id));
  }
  return confusion;
}

absl::StatusOr<ConfusionMatrix> CrossValidate(const TrainingSet& set,
                                              std::span<const std::size_t> groups,
                                              CloudSource source,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop) {
  const std::size_t apart = groups.empty() ? 0 : *std::ranges::max_element(groups) + 1;
  if (folds < 2 || folds > apart) {
    return absl::InvalidArgumentError(absl::StrCat(
        "folds ", folds, " is not in [2, ", apart, "], the number of labelled scans or regions"));
  }
  const std::vector<std::size_t> fold_of_group = DrawFolds(apart, folds, kFoldSeed);
  ConfusionMatrix confusion(set.classes.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<std::size_t> others;
    std::vector<std::size_t> left_out;
    for (std::size_t k = 0; k < groups.size(); ++k) {
      (fold_of_group[groups[k]] == fold ? left_out : others).push_back(k);
    }
    STRATA_ASSIGN_OR_RETURN(const Classifier classifier, LearnClassifier(set, others, stop));
    for (std::size_t i = 0; i < left_out.size(); ++i) {
      const double share = static_cast<double>(i + 1) / static_cast<double>(left_out.size());
      STRATA_RETURN_IF_ERROR(
          progress((static_cast<double>(fold) + share) / static_cast<double>(folds)));
      STRATA_RETURN_IF_ERROR(source(left_out[i], [&](const PointCloud& part) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(const ConfusionMatrix counts,
                                EvaluateClassifier(classifier, part, set.classes, stop));
        confusion.Add(counts);
        return absl::OkStatus();
      }));
    }
  }
  return confusion;
}

}  // namespace strata
