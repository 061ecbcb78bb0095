#include "client/sdk/remote_models.h"

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "proto/translate/models.h"

namespace strata::sdk {

using translate::FromProto;

absl::StatusOr<PlaneModelInfo> RemoteModels::GetPlaneModel(
    const api::Call& call,
    absl::string_view map,
    absl::FunctionRef<absl::Status(const ModelPlane&)> sink) {
  v1::GetPlaneModelRequest in;
  in.set_map(std::string(map));
  PlaneModelInfo info;
  const auto take = [&](const v1::GetPlaneModelResponse& out) -> absl::Status {
    if (out.has_model()) {
      STRATA_ASSIGN_OR_RETURN(info, FromProto(out.model()));
      return absl::OkStatus();
    }
    STRATA_ASSIGN_OR_RETURN(const ModelPlane plane, FromProto(out.plane()));
    return sink(plane);
  };
  STRATA_RETURN_IF_ERROR(
      CallStream(connection_, *stub_, &v1::Models::Stub::GetPlaneModel, call, in, take));
  return info;
}

}  // namespace strata::sdk
