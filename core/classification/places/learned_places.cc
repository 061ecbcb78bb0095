#include "core/classification/places/place_model.h"

namespace strata {

const PlaceModel& LearnedPlaceModel() {
  static const PlaceModel model;
  return model;
}

}  // namespace strata
