#include "server/services/models_service.h"

#include "absl/status/status.h"

#include "core/api/database.h"
#include "core/common/status.h"
#include "proto/translate/models.h"
#include "strata/v1/models.pb.h"

namespace strata::server {
namespace {

using translate::ToProto;

absl::Status GetPlaneModel(api::Database& db,
                           const api::Call& call,
                           const v1::GetPlaneModelRequest& in,
                           StreamSink<v1::GetPlaneModelResponse> sink) {
  v1::GetPlaneModelResponse out;
  STRATA_ASSIGN_OR_RETURN(const PlaneModelInfo info,
                          db.models().GetPlaneModel(call, in.map(), [&](const ModelPlane& plane) {
                            *out.mutable_plane() = ToProto(plane);
                            return sink(out);
                          }));
  *out.mutable_model() = ToProto(info);
  return sink(out);
}

}  // namespace

ModelsService::ModelsService(Runtime& runtime) : Service(runtime, "Models") {
  Stream("GetPlaneModel", &GetPlaneModel);
}

}  // namespace strata::server
