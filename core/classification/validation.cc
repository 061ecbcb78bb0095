#include "core/classification/validation.h"

#include <cstdint>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint64_t kFoldSeed = 1;

// Those of `classes` that label a point of `clouds`.
std::vector<ClassName> ClassesIn(const std::vector<PointCloud>& clouds,
                                 const std::vector<ClassName>& classes) {
  std::set<std::uint16_t> seen;
  for (const PointCloud& cloud : clouds) seen.insert(cloud.label.begin(), cloud.label.end());
  std::vector<ClassName> found;
  for (const ClassName& name : classes) {
    if (seen.contains(name.id)) found.push_back(name);
  }
  return found;
}

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

absl::StatusOr<ConfusionMatrix> CrossValidate(const std::vector<PointCloud>& clouds,
                                              const std::vector<ClassName>& classes,
                                              const TrainingOptions& options,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop) {
  if (folds < 2 || folds > clouds.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "folds ", folds, " is not in [2, ", clouds.size(), "], the number of labelled clouds"));
  }
  const std::vector<std::size_t> fold_of = DrawFolds(clouds.size(), folds, kFoldSeed);
  ConfusionMatrix confusion(classes.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<PointCloud> others;
    for (std::size_t i = 0; i < clouds.size(); ++i) {
      if (fold_of[i] != fold) others.push_back(clouds[i]);
    }
    const auto part = [&](double share) {
      return progress((static_cast<double>(fold) + share) / static_cast<double>(folds));
    };
    STRATA_ASSIGN_OR_RETURN(
        const Classifier classifier,
        TrainClassifier(others, ClassesIn(others, classes), options, part, stop));
    for (std::size_t i = 0; i < clouds.size(); ++i) {
      if (fold_of[i] != fold) continue;
      STRATA_ASSIGN_OR_RETURN(const ConfusionMatrix counts,
                              EvaluateClassifier(classifier, clouds[i], classes, stop));
      confusion.Add(counts);
    }
  }
  return confusion;
}

}  // namespace strata
