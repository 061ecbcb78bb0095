#include "server/services/planning_service.h"

#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/world/names.h"
#include "core/world/plan.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/places.h"
#include "proto/translate/planning.h"
#include "proto/translate/shape.h"
#include "server/services/path_watch_reactor.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

// A place that nobody gave is not the map's origin.
absl::Status CheckGiven(bool given, absl::string_view field) {
  if (given) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is missing; give it as {\"x_m\": 1.5, \"y_m\": 2}"));
}

absl::Status PlanPath(api::Database& db,
                      const api::Call& call,
                      const v1::PlanPathRequest& in,
                      v1::PlanPathResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const PlanQuery query, AtTheDoor(FromProto(in)));
  STRATA_RETURN_IF_ERROR(AtTheDoor(CheckGiven(in.has_from(), "from")));
  STRATA_RETURN_IF_ERROR(AtTheDoor(CheckGiven(in.has_to(), "to")));
  STRATA_ASSIGN_OR_RETURN(const PlanResult result, db.planning().PlanPath(call, in.map(), query));
  out = ToProto(result);
  return absl::OkStatus();
}

absl::Status CheckPath(api::Database& db,
                       const api::Call& call,
                       const v1::CheckPathRequest& in,
                       v1::CheckPathResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const PathQuery query, AtTheDoor(FromProto(in)));
  STRATA_ASSIGN_OR_RETURN(const PathCheck check, db.planning().CheckPath(call, in.map(), query));
  *out.mutable_check() = ToProto(check);
  return absl::OkStatus();
}

absl::Status ListFloors(api::Database& db,
                        const api::Call& call,
                        const v1::ListFloorsRequest& in,
                        v1::ListFloorsResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const FloorQuery query, AtTheDoor(FromProto(in)));
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan, db.planning().ListFloors(call, in.map(), query));
  out = ToProto(plan);
  return absl::OkStatus();
}

absl::Status ListPlaces(api::Database& db,
                        const api::Call& call,
                        const v1::ListPlacesRequest& in,
                        v1::ListPlacesResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const PlaceQuery query, AtTheDoor(FromProto(in)));
  STRATA_ASSIGN_OR_RETURN(const FloorPlaces places,
                          db.planning().ListPlaces(call, in.map(), query));
  out = ToProto(places);
  return absl::OkStatus();
}

absl::Status Explore(api::Database& db,
                     const api::Call& call,
                     const v1::ExploreRequest& in,
                     v1::ExploreResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const ExploreQuery query, AtTheDoor(FromProto(in)));
  STRATA_RETURN_IF_ERROR(AtTheDoor(CheckGiven(in.has_from(), "from")));
  STRATA_ASSIGN_OR_RETURN(const ExploreResult result, db.planning().Explore(call, in.map(), query));
  out = ToProto(result);
  return absl::OkStatus();
}

absl::Status CheckShape(api::Database& db,
                        const api::Call& call,
                        const v1::CheckShapeRequest& in,
                        v1::CheckShapeResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const ShapeQuery query, AtTheDoor(FromProto(in)));
  STRATA_ASSIGN_OR_RETURN(const ShapeCheck check, db.planning().CheckShape(call, in.map(), query));
  out = ToProto(check);
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Eigen::Vector2d>> PlacesOf(const v1::SampleSurfacesRequest& in) {
  std::vector<Eigen::Vector2d> places;
  places.reserve(static_cast<std::size_t>(in.places_size()));
  for (int i = 0; i < in.places_size(); ++i) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector2d place,
                            FromProto(absl::StrCat("places[", i, "]"), in.places(i)));
    places.push_back(place);
  }
  return places;
}

absl::Status SampleSurfaces(api::Database& db,
                            const api::Call& call,
                            const v1::SampleSurfacesRequest& in,
                            v1::SampleSurfacesResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<Eigen::Vector2d> places, AtTheDoor(PlacesOf(in)));
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceColumn> columns,
                          db.planning().SampleSurfaces(call, in.map(), places));
  for (const SurfaceColumn& column : columns) *out.add_columns() = ToProto(column);
  return absl::OkStatus();
}

absl::Status SetProfile(api::Database& db,
                        const api::Call& call,
                        const v1::SetProfileRequest& in,
                        v1::SetProfileResponse&) {
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateName("profile name", in.name())));
  const RobotProfile profile = FromProto(in.profile());
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateRobotProfile(profile)));
  return db.planning().SetProfile(call, in.map(), in.name(), profile);
}

absl::Status ListProfiles(api::Database& db,
                          const api::Call& call,
                          const v1::ListProfilesRequest& in,
                          v1::ListProfilesResponse& out) {
  using Profiles = std::map<std::string, RobotProfile>;
  STRATA_ASSIGN_OR_RETURN(const Profiles profiles, db.planning().ListProfiles(call, in.map()));
  for (const auto& [name, profile] : profiles) (*out.mutable_profiles())[name] = ToProto(profile);
  return absl::OkStatus();
}

}  // namespace

PlanningService::PlanningService(Runtime& runtime) : Service(runtime, "Planning") {
  Unary("PlanPath", &PlanPath);
  Unary("CheckPath", &CheckPath);
  Poll<PathWatchReactor>("WatchPath");
  Unary("ListFloors", &ListFloors);
  Unary("ListPlaces", &ListPlaces);
  Unary("Explore", &Explore);
  Unary("CheckShape", &CheckShape);
  Unary("SampleSurfaces", &SampleSurfaces);
  Unary("SetProfile", &SetProfile);
  Unary("ListProfiles", &ListProfiles);
}

}  // namespace strata::server
