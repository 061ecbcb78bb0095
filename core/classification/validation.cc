#include "core/classification/validation.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint64_t kFoldSeed = 1;

// The labels of each cloud.
absl::StatusOr<std::vector<std::set<std::uint16_t>>> LabelsOf(std::size_t clouds,
                                                              CloudSource source) {
  std::vector<std::set<std::uint16_t>> labels(clouds);
  for (std::size_t k = 0; k < clouds; ++k) {
    STRATA_RETURN_IF_ERROR(source(k, [&](const PointCloud& part) {
      labels[k].insert(part.label.begin(), part.label.end());
      return absl::OkStatus();
    }));
  }
  return labels;
}

// Those of `classes` that label a point of one of the clouds `chosen`.
std::vector<ClassName> ClassesIn(const std::vector<std::set<std::uint16_t>>& labels,
                                 const std::vector<std::size_t>& chosen,
                                 const std::vector<ClassName>& classes) {
  std::vector<ClassName> found;
  for (const ClassName& name : classes) {
    const bool seen = std::any_of(
        chosen.begin(), chosen.end(), [&](std::size_t k) { return labels[k].contains(name.id); });
    if (seen) found.push_back(name);
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
                                              std::span<const std::size_t> groups,
                                              const std::vector<ClassName>& classes,
                                              const TrainingOptions& options,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop) {
  const auto source = [&clouds](std::size_t k,
                                absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    return use(clouds[k]);
  };
  return CrossValidate(groups, source, classes, options, folds, progress, stop);
}

absl::StatusOr<ConfusionMatrix> CrossValidate(std::span<const std::size_t> groups,
                                              CloudSource source,
                                              const std::vector<ClassName>& classes,
                                              const TrainingOptions& options,
                                              std::size_t folds,
                                              ClassifierProgress progress,
                                              const Stop& stop) {
  const std::size_t clouds = groups.size();
  const std::size_t apart = groups.empty() ? 0 : *std::ranges::max_element(groups) + 1;
  if (folds < 2 || folds > apart) {
    return absl::InvalidArgumentError(absl::StrCat(
        "folds ", folds, " is not in [2, ", apart, "], the number of labelled scans or regions"));
  }
  const std::vector<std::size_t> fold_of_group = DrawFolds(apart, folds, kFoldSeed);
  const auto fold_of = [&](std::size_t cloud) { return fold_of_group[groups[cloud]]; };
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::set<std::uint16_t>> labels,
                          LabelsOf(clouds, source));
  ConfusionMatrix confusion(classes.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<std::size_t> others;
    for (std::size_t k = 0; k < clouds; ++k) {
      if (fold_of(k) != fold) others.push_back(k);
    }
    STRATA_ASSIGN_OR_RETURN(
        const Classifier classifier,
        TrainClassifier(
            others.size(),
            [&](std::size_t i, absl::FunctionRef<absl::Status(const PointCloud&)> use) {
              return source(others[i], use);
            },
            ClassesIn(labels, others, classes),
            options,
            [&](double share) {
              return progress((static_cast<double>(fold) + share) / static_cast<double>(folds));
            },
            stop));
    for (std::size_t k = 0; k < clouds; ++k) {
      if (fold_of(k) != fold) continue;
      STRATA_RETURN_IF_ERROR(source(k, [&](const PointCloud& part) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(const ConfusionMatrix counts,
                                EvaluateClassifier(classifier, part, classes, stop));
        confusion.Add(counts);
        return absl::OkStatus();
      }));
    }
  }
  return confusion;
}

}  // namespace strata
