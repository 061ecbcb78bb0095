#include "proto/translate/places.h"

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/planning.h"

namespace strata::translate {

static_assert(v1::PLACE_KIND_ROOM == static_cast<int>(PlaceKind::kRoom));
static_assert(v1::PLACE_KIND_CORRIDOR == static_cast<int>(PlaceKind::kCorridor));
static_assert(v1::PLACE_KIND_DOORWAY == static_cast<int>(PlaceKind::kDoorway));

v1::ListPlacesRequest ToProto(absl::string_view map, const PlaceQuery& query) {
  v1::ListPlacesRequest proto;
  proto.set_map(std::string(map));
  *proto.mutable_profile() = ToProto(query.profile);
  if (query.floor.has_value()) proto.set_floor(*query.floor);
  if (query.at.has_value()) *proto.mutable_at() = EndpointToProto(*query.at);
  proto.set_cells(query.cells);
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

absl::StatusOr<PlaceQuery> FromProto(const v1::ListPlacesRequest& proto) {
  PlaceQuery query;
  query.profile = FromProto(proto.profile());
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(query.profile));
  if (proto.has_floor()) query.floor = proto.floor();
  if (proto.has_at()) {
    STRATA_ASSIGN_OR_RETURN(query.at, EndpointFromProto("at", proto.at()));
  }
  query.cells = proto.cells();
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  return query;
}

v1::ListPlacesResponse ToProto(const FloorPlaces& places) {
  v1::ListPlacesResponse proto;
  for (const Place& place : places.places) {
    v1::Place& out = *proto.add_places();
    out.set_kind(static_cast<v1::PlaceKind>(place.kind));
    out.set_area_m2(place.area_m2);
    *out.mutable_low() = ToProto(place.low);
    *out.mutable_high() = ToProto(place.high);
    *out.mutable_middle() = ToProto(place.middle);
    out.mutable_neighbours()->Add(place.neighbours.begin(), place.neighbours.end());
    for (const PlaceBlock& block : place.blocks) {
      v1::PlaceBlock& added = *out.add_blocks();
      added.set_x(block.x);
      added.set_y(block.y);
      added.set_cells(block.cells);
    }
  }
  if (places.floor.has_value()) proto.set_floor(*places.floor);
  proto.set_message(places.message);
  proto.set_cell_size_m(places.cell_size_m);
  proto.set_epoch(places.epoch);
  proto.set_commit_sequence(places.commit_sequence);
  return proto;
}

absl::StatusOr<FloorPlaces> FromProto(const v1::ListPlacesResponse& proto) {
  FloorPlaces places;
  for (const v1::Place& place : proto.places()) {
    if (place.kind() == v1::PLACE_KIND_UNSPECIFIED || !v1::PlaceKind_IsValid(place.kind())) {
      return absl::InvalidArgumentError(
          absl::StrCat("place: kind ", static_cast<int>(place.kind()), " is not known"));
    }
    Place& added = places.places.emplace_back();
    added.kind = static_cast<PlaceKind>(place.kind());
    added.area_m2 = place.area_m2();
    STRATA_ASSIGN_OR_RETURN(added.low, FromProto("low", place.low()));
    STRATA_ASSIGN_OR_RETURN(added.high, FromProto("high", place.high()));
    STRATA_ASSIGN_OR_RETURN(added.middle, FromProto("middle", place.middle()));
    added.neighbours.assign(place.neighbours().begin(), place.neighbours().end());
    for (const v1::PlaceBlock& block : place.blocks()) {
      added.blocks.push_back({block.x(), block.y(), block.cells()});
    }
  }
  if (proto.has_floor()) places.floor = proto.floor();
  places.message = proto.message();
  places.cell_size_m = proto.cell_size_m();
  places.epoch = proto.epoch();
  places.commit_sequence = proto.commit_sequence();
  return places;
}

}  // namespace strata::translate
