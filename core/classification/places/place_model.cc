#include "core/classification/places/place_model.h"

#include <utility>

#include "core/classification/amn/amn_inference.h"
#include "core/common/status.h"

namespace strata {

FeatureMatrix StandardFeatures(const PlaceModel& model, FeatureMatrix features) {
  features.rowwise() -= model.mean;
  features.array().rowwise() /= model.deviation.array();
  features.conservativeResize(Eigen::NoChange, features.cols() + 1);
  features.rightCols(1).setOnes();
  return features;
}

absl::StatusOr<std::vector<PlaceKind>> NamePlaces(const PlaceModel& model,
                                                  const FreeSpace& space,
                                                  const PlaceSamples& samples,
                                                  const Stop& stop) {
  if (samples.size() == 0) return std::vector<PlaceKind>();
  STRATA_ASSIGN_OR_RETURN(FeatureMatrix features,
                          PlaceFeatures(space, samples, model.columns, stop));
  features = StandardFeatures(model, std::move(features));
  const std::vector<NetworkEdge> edges = samples.Edges();
  STRATA_ASSIGN_OR_RETURN(const AmnLabels found,
                          MaximizeScore(MakeAmnProblem(model.weights, features, edges), stop));
  std::vector<PlaceKind> kinds;
  kinds.reserve(found.labels.size());
  for (const ClassIndex label : found.labels) kinds.push_back(kPlaceKinds[label]);
  return kinds;
}

}  // namespace strata
