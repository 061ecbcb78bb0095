#include "client/sdk/remote_planning.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/places.h"
#include "proto/translate/planning.h"
#include "proto/translate/shape.h"

namespace strata::sdk {
namespace {

// The server's bound for one request.
constexpr std::size_t kMaxPlacesPerRequest = 10'000;

}  // namespace

using translate::FromProto;
using translate::ToProto;

absl::StatusOr<PlanResult> RemotePlanning::PlanPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PlanQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::PlanPathResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::PlanPath,
                                    call,
                                    Repeat::kOnTrouble,
                                    ToProto(map, query)));
  return FromProto(out);
}

absl::StatusOr<PathCheck> RemotePlanning::CheckPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PathQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::CheckPathResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::CheckPath,
                                    call,
                                    Repeat::kOnTrouble,
                                    translate::CheckToProto(map, query)));
  return FromProto(out.check());
}

absl::Status RemotePlanning::WatchPath(const api::Call& call,
                                       absl::string_view map,
                                       const PathQuery& query,
                                       absl::FunctionRef<absl::Status(const PathCheck&)> sink) {
  const v1::WatchPathRequest in = translate::WatchToProto(map, query);
  std::optional<bool> told;
  Backoff backoff = connection_.NewEndlessBackoff();
  Route<v1::Planning::Stub> route(connection_, *stub_);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    absl::Status taken;
    const auto deliver = [&](const v1::WatchPathResponse& out) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const PathCheck check, FromProto(out.check()));
      if (told == check.valid) return absl::OkStatus();  // as before the connection broke
      told = check.valid;
      taken = sink(check);
      return taken;
    };
    AttemptContext context(connection_, call);
    bool delivered = false;
    const std::unique_ptr<grpc::ClientReader<v1::WatchPathResponse>> reader =
        route.stub().WatchPath(context.get(), in);
    const absl::Status ended = ReadStream(context, *reader, call, deliver, delivered);
    if (delivered) backoff = connection_.NewEndlessBackoff();
    if (ended.ok() || !taken.ok()) return ended;
    route.Follow(ended, backoff);
    if (!backoff.Wait(ended, call.stop)) return call.stop.requested() ? call.stop.status() : ended;
  }
}

absl::StatusOr<FloorPlan> RemotePlanning::ListFloors(const api::Call& call,
                                                     absl::string_view map,
                                                     const FloorQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::ListFloorsResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::ListFloors,
                                    call,
                                    Repeat::kOnTrouble,
                                    ToProto(map, query)));
  return FromProto(out);
}

absl::StatusOr<FloorPlaces> RemotePlanning::ListPlaces(const api::Call& call,
                                                       absl::string_view map,
                                                       const PlaceQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::ListPlacesResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::ListPlaces,
                                    call,
                                    Repeat::kOnTrouble,
                                    translate::ToProto(map, query)));
  return translate::FromProto(out);
}

absl::StatusOr<ExploreResult> RemotePlanning::Explore(const api::Call& call,
                                                      absl::string_view map,
                                                      const ExploreQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::ExploreResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::Explore,
                                    call,
                                    Repeat::kOnTrouble,
                                    ToProto(map, query)));
  return FromProto(out);
}

absl::StatusOr<ShapeCheck> RemotePlanning::CheckShape(const api::Call& call,
                                                      absl::string_view map,
                                                      const ShapeQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const v1::CheckShapeResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Planning::Stub::CheckShape,
                                    call,
                                    Repeat::kOnTrouble,
                                    translate::ToProto(map, query)));
  return translate::FromProto(out);
}

absl::StatusOr<std::vector<SurfaceColumn>> RemotePlanning::SampleSurfaces(
    const api::Call& call, absl::string_view map, const std::vector<Eigen::Vector2d>& places) {
  std::vector<SurfaceColumn> columns;
  std::size_t begin = 0;
  do {  // also without places: the map may not exist
    const std::size_t end = std::min(places.size(), begin + kMaxPlacesPerRequest);
    v1::SampleSurfacesRequest in;
    in.set_map(std::string(map));
    for (; begin < end; ++begin) *in.add_places() = ToProto(places[begin]);
    STRATA_ASSIGN_OR_RETURN(const v1::SampleSurfacesResponse out,
                            CallUnary(connection_,
                                      *stub_,
                                      &v1::Planning::Stub::SampleSurfaces,
                                      call,
                                      Repeat::kOnTrouble,
                                      in));
    for (const v1::SurfaceColumn& column : out.columns()) {
      STRATA_ASSIGN_OR_RETURN(SurfaceColumn added, FromProto(column));
      columns.push_back(std::move(added));
    }
  } while (begin < places.size());
  return columns;
}

absl::Status RemotePlanning::SetProfile(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        const RobotProfile& profile) {
  v1::SetProfileRequest in;
  in.set_map(std::string(map));
  in.set_name(std::string(name));
  *in.mutable_profile() = ToProto(profile);
  return CallUnary(
             connection_, *stub_, &v1::Planning::Stub::SetProfile, call, Repeat::kOnTrouble, in)
      .status();
}

absl::StatusOr<std::map<std::string, RobotProfile>> RemotePlanning::ListProfiles(
    const api::Call& call, absl::string_view map) {
  v1::ListProfilesRequest in;
  in.set_map(std::string(map));
  STRATA_ASSIGN_OR_RETURN(
      const v1::ListProfilesResponse out,
      CallUnary(
          connection_, *stub_, &v1::Planning::Stub::ListProfiles, call, Repeat::kOnTrouble, in));
  std::map<std::string, RobotProfile> profiles;
  for (const auto& [name, profile] : out.profiles()) profiles.emplace(name, FromProto(profile));
  return profiles;
}

}  // namespace strata::sdk
