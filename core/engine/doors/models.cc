#include "core/engine/doors/models.h"

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/map/map_state.h"
#include "core/engine/models/plane_models.h"

namespace strata {

absl::StatusOr<PlaneModelInfo> EngineModels::GetPlaneModel(
    const api::Call& call,
    absl::string_view map,
    absl::FunctionRef<absl::Status(const ModelPlane&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  PlaneModelInfo info;
  STRATA_RETURN_IF_ERROR(found.ReadMap(MapState::kNoChanges, [&](MapState& state) {
    return AssignTo(ReadPlaneModel(state, call.stop, sink), info);
  }));
  return info;
}

}  // namespace strata
