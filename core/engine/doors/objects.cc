#include "core/engine/doors/objects.h"

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/objects/entities.h"

namespace strata {

absl::StatusOr<EntitiesInfo> EngineObjects::ListEntities(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const Entity&)> sink) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return ReadEntities(found->core(), query, call.stop, sink);
}

}  // namespace strata
