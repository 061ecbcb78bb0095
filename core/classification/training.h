// What classifiers are learned from: clouds whose points have been given their features, once.
#ifndef STRATA_CORE_CLASSIFICATION_TRAINING_H_
#define STRATA_CORE_CLASSIFICATION_TRAINING_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/classification/amn/network.h"
#include "core/classification/classifier.h"
#include "core/classification/features/labelled_features.h"
#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"

namespace strata {

// Told how far it is, in [0, 1]; may end the work.
using ClassifierProgress = absl::FunctionRef<absl::Status(double progress)>;

// Clouds that come one after the other, so that they need not be in memory together: hands the
// parts of cloud k to `use`, in order and always the same; each part is a cloud of its own, and is
// all that is in memory. An error of `use` is handed back.
using CloudSource = absl::FunctionRef<absl::Status(
    std::size_t k, absl::FunctionRef<absl::Status(const PointCloud&)> use)>;

// One cloud's labelled points, with their features and reduced among themselves, and their network.
struct TrainingCloud {
  LabelledFeatures data;  // may lack classes
  std::vector<NetworkEdge> edges;
  std::vector<std::uint32_t> counts;       // of every row: how many points it stands for
  std::vector<std::uint32_t> inner_edges;  // of every row: how many edges are among those
  std::uint64_t points_seen = 0;           // before reduction
};

struct TrainingSet {
  std::vector<ClassName> classes;  // by ClassIndex
  TrainingOptions options;
  std::vector<TrainingCloud> clouds;  // by their place in the source
};

// Goes once through the `clouds` clouds of a source: points whose label is one of `classes` are
// learned from; others are not looked at, but are neighbours of those. Of many clouds fewer points
// each are kept where `options` leave that open. INVALID_ARGUMENT for bad options,
// RESOURCE_EXHAUSTED where more than a million points are left to learn from.
absl::StatusOr<TrainingSet> ReadTrainingSet(std::size_t clouds,
                                            CloudSource source,
                                            const std::vector<ClassName>& classes,
                                            const TrainingOptions& options,
                                            ClassifierProgress progress,
                                            const Stop& stop);

// The source of clouds that are in memory together; they must outlive it.
inline auto SourceOf(const std::vector<PointCloud>& clouds) {
  return [&clouds](std::size_t k, absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    return use(clouds[k]);
  };
}

// Learns to tell all classes apart. INVALID_ARGUMENT for a class without a point.
absl::StatusOr<Classifier> LearnClassifier(const TrainingSet& set, const Stop& stop);

// The same from the `chosen` clouds, and of the classes that these have points of. INVALID_ARGUMENT
// unless those are two at least.
absl::StatusOr<Classifier> LearnClassifier(const TrainingSet& set,
                                           std::span<const std::size_t> chosen,
                                           const Stop& stop);

// ReadTrainingSet() and LearnClassifier(). The clouds need not be of one place.
absl::StatusOr<Classifier> TrainClassifier(const std::vector<PointCloud>& clouds,
                                           const std::vector<ClassName>& classes,
                                           const TrainingOptions& options,
                                           ClassifierProgress progress,
                                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_TRAINING_H_
