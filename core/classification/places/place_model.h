// What tells rooms, corridors and doorways apart: a network's weights over features that boosting
// chose (thesis 8.5, 9.2).
#ifndef STRATA_CORE_CLASSIFICATION_PLACES_PLACE_MODEL_H_
#define STRATA_CORE_CLASSIFICATION_PLACES_PLACE_MODEL_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/classification/amn/amn.h"
#include "core/classification/places/free_space.h"
#include "core/classification/places/place_features.h"
#include "core/common/stop.h"
#include "core/world/place.h"

namespace strata {

// Class k is kPlaceKinds[k].
struct PlaceModel {
  std::vector<std::uint32_t> columns;  // of RangeScanFeatures
  Eigen::RowVectorXf mean;             // of each, in training
  Eigen::RowVectorXf deviation;
  AmnWeights weights;  // a column more than `columns`: the constant
};

// Learned from drawn floor plans; learned_places.cc says how it is made anew.
const PlaceModel& LearnedPlaceModel();

// `features` of the model's columns as its network sees them: in deviations from the mean, and the
// constant 1 as the last column.
FeatureMatrix StandardFeatures(const PlaceModel& model, FeatureMatrix features);

// The kind of every sample: what fits its features and its neighbours best. Deterministic. Errors
// are those of `stop`.
absl::StatusOr<std::vector<PlaceKind>> NamePlaces(const PlaceModel& model,
                                                  const FreeSpace& space,
                                                  const PlaceSamples& samples,
                                                  const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_PLACES_PLACE_MODEL_H_
