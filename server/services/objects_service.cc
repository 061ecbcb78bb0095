#include "absl/status/status.h"

#include "core/api/database.h"
#include "core/common/status.h"
#include "proto/translate/objects.h"
#include "server/services/models_service.h"
#include "strata/v1/objects.pb.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

absl::Status ListEntities(api::Database& db,
                          const api::Call& call,
                          const v1::ListEntitiesRequest& in,
                          StreamSink<v1::ListEntitiesResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const EntityQuery query, FromProto(in));
  v1::ListEntitiesResponse out;
  STRATA_ASSIGN_OR_RETURN(
      const EntitiesInfo info,
      db.objects().ListEntities(call, in.map(), query, [&](const Entity& entity) {
        *out.mutable_entity() = ToProto(entity);
        return sink(out);
      }));
  *out.mutable_search() = ToProto(info);
  return sink(out);
}

}  // namespace

ObjectsService::ObjectsService(Runtime& runtime) : Service(runtime, "Objects") {
  Stream("ListEntities", &ListEntities);
}

}  // namespace strata::server
