#include "client/sdk/remote_objects.h"

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "proto/translate/objects.h"

namespace strata::sdk {

using translate::FromProto;

absl::StatusOr<EntitiesInfo> RemoteObjects::ListEntities(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const Entity&)> sink) {
  EntitiesInfo info;
  const auto take = [&](const v1::ListEntitiesResponse& out) -> absl::Status {
    if (out.has_search()) {
      STRATA_ASSIGN_OR_RETURN(info, FromProto(out.search()));
      return absl::OkStatus();
    }
    STRATA_ASSIGN_OR_RETURN(const Entity entity, FromProto(out.entity()));
    return sink(entity);
  };
  STRATA_RETURN_IF_ERROR(CallStream(connection_,
                                    *stub_,
                                    &v1::Objects::Stub::ListEntities,
                                    call,
                                    translate::ToProto(map, query),
                                    take));
  return info;
}

}  // namespace strata::sdk
