#include <vector>

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

absl::Status ListKinds(api::Database& db,
                       const api::Call& call,
                       const v1::ListKindsRequest& in,
                       v1::ListKindsResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds,
                          db.objects().ListKinds(call, in.map()));
  for (const KindInfo& kind : kinds) *out.add_kinds() = ToProto(kind);
  return absl::OkStatus();
}

absl::Status GetKind(api::Database& db,
                     const api::Call& call,
                     const v1::GetKindRequest& in,
                     v1::GetKindResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const ThingKind kind, db.objects().GetKind(call, in.map(), in.kind()));
  *out.mutable_kind() = ToProto(kind.info);
  *out.mutable_shape() = ToProto(kind.shape);
  return absl::OkStatus();
}

absl::Status RenameKind(api::Database& db,
                        const api::Call& call,
                        const v1::RenameKindRequest& in,
                        v1::RenameKindResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const KindInfo kind,
                          db.objects().RenameKind(call, in.map(), in.kind(), in.name()));
  *out.mutable_kind() = ToProto(kind);
  return absl::OkStatus();
}

absl::Status ImportKind(api::Database& db,
                        const api::Call& call,
                        const v1::ImportKindRequest& in,
                        v1::ImportKindResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const NewKind kind, FromProto(in));
  STRATA_ASSIGN_OR_RETURN(const KindInfo info, db.objects().ImportKind(call, in.map(), kind));
  *out.mutable_kind() = ToProto(info);
  return absl::OkStatus();
}

absl::Status DeleteKind(api::Database& db,
                        const api::Call& call,
                        const v1::DeleteKindRequest& in,
                        v1::DeleteKindResponse&) {
  return db.objects().DeleteKind(call, in.map(), in.kind());
}

absl::Status ListInferred(api::Database& db,
                          const api::Call& call,
                          const v1::ListInferredRequest& in,
                          StreamSink<v1::ListInferredResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const EntityQuery query, FromProto(in));
  v1::ListInferredResponse out;
  STRATA_ASSIGN_OR_RETURN(
      const InferredInfo info,
      db.objects().ListInferred(call, in.map(), query, [&](const InferredPart& part) {
        *out.mutable_inferred() = ToProto(part);
        return sink(out);
      }));
  *out.mutable_search() = ToProto(info);
  return sink(out);
}

}  // namespace

ObjectsService::ObjectsService(Runtime& runtime) : Service(runtime, "Objects") {
  Stream("ListEntities", &ListEntities);
  Unary("ListKinds", &ListKinds);
  Unary("GetKind", &GetKind);
  Unary("RenameKind", &RenameKind);
  Unary("ImportKind", &ImportKind);
  Unary("DeleteKind", &DeleteKind);
  Stream("ListInferred", &ListInferred);
}

}  // namespace strata::server
