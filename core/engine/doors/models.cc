#include "core/engine/doors/models.h"

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/models/plane_models.h"

namespace strata {

absl::StatusOr<PlaneModelInfo> EngineModels::GetPlaneModel(
    const api::Call& call,
    absl::string_view map,
    absl::FunctionRef<absl::Status(const ModelPlane&)> sink) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(call.stop, map));
  return ReadPlaneModel(found->core(), call.stop, sink);
}

}  // namespace strata
