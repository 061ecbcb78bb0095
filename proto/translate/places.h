// Places of a floor, between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_PLACES_H_
#define STRATA_PROTO_TRANSLATE_PLACES_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/place.h"
#include "strata/v1/planning.pb.h"

namespace strata::translate {

v1::ListPlacesRequest ToProto(absl::string_view map, const PlaceQuery& query);
v1::ListPlacesResponse ToProto(const FloorPlaces& places);

// INVALID_ARGUMENT for a bad profile, place or number, and for both of number and place.
absl::StatusOr<PlaceQuery> FromProto(const v1::ListPlacesRequest& request);
// INVALID_ARGUMENT for a kind that is none, and a neighbour that is not there.
absl::StatusOr<FloorPlaces> FromProto(const v1::ListPlacesResponse& places);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_PLACES_H_
