#include "core/engine/doors/planning.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/ingest/edits.h"
#include "core/world/names.h"

namespace strata {

absl::Status EnginePlanning::Ask(const MapReading& map,
                                 std::uint64_t since,
                                 absl::FunctionRef<absl::Status(MapPlanner&, MapState&)> body) {
  if (map.map() != nullptr) {
    return map.ReadMapTiles(since,
                            [&](MapState& state) { return body(map.map()->planner(), state); });
  }
  const auto make = [&]() -> absl::StatusOr<std::shared_ptr<MapPlanner>> {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, map.store()->NewReader());
    STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader->GetMapInfo());
    return std::make_shared<MapPlanner>(
        map.name(), info.parameters, maps_.options(), maps_.caches());
  };
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<MapPlanner> planner,
                          elsewhere_.Find(map.name(), map.store()->number(), make));
  return map.ReadMapTiles(since, [&](MapState& state) { return body(*planner, state); });
}

template <typename Answer>
absl::StatusOr<Answer> EnginePlanning::Ask(
    const api::Call& call,
    absl::string_view map,
    absl::FunctionRef<absl::StatusOr<Answer>(MapPlanner&, MapState&)> body) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindTilesToRead(call, map));
  Answer answer;
  STRATA_RETURN_IF_ERROR(
      Ask(found, MapState::kNoChanges, [&](MapPlanner& planner, MapState& state) {
        return AssignTo(body(planner, state), answer);
      }));
  return answer;
}

absl::StatusOr<PlanResult> EnginePlanning::PlanPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PlanQuery& query) {
  return Ask<PlanResult>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.Plan(state, query, call.stop);
  });
}

absl::StatusOr<PathCheck> EnginePlanning::Check(const MapReading& map,
                                                const PathQuery& query,
                                                const Stop& stop) {
  PathCheck check;
  const std::uint64_t since =
      query.known.has_value() ? query.known->commit_sequence : MapState::kNoChanges;
  STRATA_RETURN_IF_ERROR(Ask(map, since, [&](MapPlanner& planner, MapState& state) {
    return AssignTo(planner.Check(state, query, stop), check);
  }));
  return check;
}

absl::StatusOr<PathCheck> EnginePlanning::CheckPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PathQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindTilesToRead(call, map));
  return Check(found, query, call.stop);
}

absl::Status EnginePlanning::WatchPath(const api::Call& call,
                                       absl::string_view map,
                                       const PathQuery& query,
                                       absl::FunctionRef<absl::Status(const PathCheck&)> sink) {
  PathQuery asked = query;
  asked.known.reset();
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindTilesToRead(call, map));
    STRATA_ASSIGN_OR_RETURN(const PathCheck check, Check(found, asked, call.stop));
    if (!asked.known.has_value() || asked.known->valid != check.valid) {
      STRATA_RETURN_IF_ERROR(sink(check));
    }
    asked.known = check;
    STRATA_RETURN_IF_ERROR(maps_.AwaitNews(found, check.commit_sequence, check.epoch, call.stop));
  }
}

absl::StatusOr<FloorPlan> EnginePlanning::ListFloors(const api::Call& call,
                                                     absl::string_view map,
                                                     const FloorQuery& query) {
  return Ask<FloorPlan>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.Floors(state, query, call.stop);
  });
}

absl::StatusOr<FloorPlaces> EnginePlanning::ListPlaces(const api::Call& call,
                                                       absl::string_view map,
                                                       const PlaceQuery& query) {
  return Ask<FloorPlaces>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.Places(state, query, call.stop);
  });
}

absl::StatusOr<ExploreResult> EnginePlanning::Explore(const api::Call& call,
                                                      absl::string_view map,
                                                      const ExploreQuery& query) {
  return Ask<ExploreResult>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.Explore(state, query, call.stop);
  });
}

absl::StatusOr<ShapeCheck> EnginePlanning::CheckShape(const api::Call& call,
                                                      absl::string_view map,
                                                      const ShapeQuery& query) {
  return Ask<ShapeCheck>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.CheckShape(state, query, call.stop);
  });
}

absl::StatusOr<std::vector<SurfaceColumn>> EnginePlanning::SampleSurfaces(
    const api::Call& call, absl::string_view map, const std::vector<Eigen::Vector2d>& places) {
  return Ask<std::vector<SurfaceColumn>>(call, map, [&](MapPlanner& planner, MapState& state) {
    return planner.Sample(state, places, call.stop);
  });
}

absl::Status EnginePlanning::SetProfile(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        const RobotProfile& profile) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateName("profile name", name));
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(profile));
  if (name == api::kDefaultProfile) {
    return maps_.Edit(call.stop, map, place, SettingDefaultProfile(profile));
  }
  return place.Commit(call.stop,
                      [&](StorageWriter& writer) { return writer.PutProfile(name, profile); });
}

absl::StatusOr<std::map<std::string, RobotProfile>> EnginePlanning::ListProfiles(
    const api::Call& call, absl::string_view map) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  std::map<std::string, RobotProfile> profiles;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(reader.ListProfiles(), profiles);
  }));
  return profiles;
}

}  // namespace strata
