#include "core/engine/doors/objects.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/map/map_state.h"
#include "core/engine/objects/completion.h"
#include "core/engine/objects/entities.h"
#include "core/engine/objects/kind_library.h"

namespace strata {

absl::StatusOr<EntitiesInfo> EngineObjects::ListEntities(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const Entity&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  EntitiesInfo info;
  STRATA_RETURN_IF_ERROR(found.ReadMap(MapState::kNoChanges, [&](MapState& state) {
    return AssignTo(ReadEntities(state, query, call.stop, sink), info);
  }));
  return info;
}

absl::StatusOr<std::vector<KindInfo>> EngineObjects::ListKinds(const api::Call& call,
                                                               absl::string_view map) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  std::vector<KindInfo> kinds;
  STRATA_RETURN_IF_ERROR(found.ReadMap(MapState::kNoChanges, [&](MapState& state) {
    return AssignTo(CountKinds(state, call.stop), kinds);
  }));
  return kinds;
}

absl::StatusOr<ThingKind> EngineObjects::GetKind(const api::Call& call,
                                                 absl::string_view map,
                                                 absl::string_view kind) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  ThingKind read;
  std::vector<KindInfo> kinds;
  STRATA_RETURN_IF_ERROR(found.ReadMap(MapState::kNoChanges, [&](MapState& state) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(read, ReadKind(state, kind));
    return AssignTo(CountKinds(state, call.stop), kinds);
  }));
  const auto counted = std::find_if(
      kinds.begin(), kinds.end(), [&](const KindInfo& info) { return info.id == read.info.id; });
  if (counted != kinds.end()) read.info.entities = counted->entities;
  return read;
}

absl::StatusOr<KindInfo> EngineObjects::RenameKind(const api::Call& call,
                                                   absl::string_view map,
                                                   absl::string_view kind,
                                                   absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  KindInfo renamed;
  STRATA_RETURN_IF_ERROR(place.Commit(call.stop, [&](StorageWriter& writer) {
    return AssignTo(strata::RenameKind(writer, kind, name), renamed);
  }));
  return renamed;
}

absl::StatusOr<KindInfo> EngineObjects::ImportKind(const api::Call& call,
                                                   absl::string_view map,
                                                   const NewKind& kind) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_ASSIGN_OR_RETURN(ImportedKind imported, PrepareKind(kind));
  STRATA_RETURN_IF_ERROR(place.Commit(
      call.stop,
      [&](StorageWriter& writer) { return PutImportedKind(writer, imported); },
      imported.shape.size()));
  return imported.info;
}

absl::Status EngineObjects::DeleteKind(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view kind) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  return place.Commit(call.stop,
                      [&](StorageWriter& writer) { return strata::DeleteKind(writer, kind); });
}

absl::StatusOr<InferredInfo> EngineObjects::ListInferred(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const InferredPart&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  InferredInfo info;
  STRATA_RETURN_IF_ERROR(found.ReadMap(MapState::kNoChanges, [&](MapState& state) {
    return AssignTo(ReadInferred(state, query, call.stop, sink), info);
  }));
  return info;
}

}  // namespace strata
