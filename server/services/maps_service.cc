#include "server/services/maps_service.h"

#include "core/common/status.h"
#include "core/world/map_info.h"
#include "core/world/names.h"
#include "proto/translate/maps.h"
#include "proto/translate/watch.h"
#include "server/rpc/request.h"
#include "server/rpc/stream.h"
#include "server/rpc/unary.h"
#include "server/services/map_watch_reactor.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

absl::Status Create(api::Database& db,
                    const api::Call& call,
                    const v1::CreateMapRequest& in,
                    v1::CreateMapResponse& out) {
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateName("map name", in.name())));
  const MapParameters parameters = FromProto(in.parameters());
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateMapParameters(parameters)));
  STRATA_ASSIGN_OR_RETURN(const MapInfo map, db.maps().Create(call, in.name(), parameters));
  *out.mutable_map() = ToProto(map);
  return absl::OkStatus();
}

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetMapRequest& in,
                 v1::GetMapResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo map, db.maps().Get(call, in.name()));
  *out.mutable_map() = ToProto(map);
  return absl::OkStatus();
}

absl::Status List(api::Database& db,
                  const Request& request,
                  const v1::ListMapsRequest&,
                  v1::ListMapsResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapInfo> maps, db.maps().List(request.call()));
  for (const MapInfo& map : maps) {
    if (request.MayRead(map.name)) *out.add_maps() = ToProto(map);
  }
  return absl::OkStatus();
}

absl::Status Delete(api::Database& db,
                    const api::Call& call,
                    const v1::DeleteMapRequest& in,
                    v1::DeleteMapResponse&) {
  return db.maps().Delete(call, in.name());
}

absl::Status Stats(api::Database& db,
                   const api::Call& call,
                   const v1::GetMapStatsRequest& in,
                   v1::GetMapStatsResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, db.maps().Stats(call, in.name()));
  *out.mutable_stats() = ToProto(stats);
  return absl::OkStatus();
}

absl::Status History(api::Database& db,
                     const api::Call& call,
                     const v1::GetMapHistoryRequest& in,
                     v1::GetMapHistoryResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs, db.maps().History(call, in.name()));
  for (const EpochInfo& epoch : epochs) *out.add_epochs() = ToProto(epoch);
  return absl::OkStatus();
}

absl::Status ListClasses(api::Database& db,
                         const api::Call& call,
                         const v1::ListMapClassesRequest& in,
                         v1::ListMapClassesResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          db.maps().ListClasses(call, in.name()));
  for (const MapClass& map_class : classes) *out.add_classes() = ToProto(map_class);
  return absl::OkStatus();
}

absl::Status SetClass(api::Database& db,
                      const api::Call& call,
                      const v1::SetMapClassRequest& in,
                      v1::SetMapClassResponse&) {
  const absl::StatusOr<MapClass> map_class = FromProto(in.map_class());
  STRATA_RETURN_IF_ERROR(AtTheDoor(map_class.status()));
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateMapClass(*map_class)));
  return db.maps().SetClass(call, in.name(), *map_class);
}

absl::Status Backup(api::Database& db,
                    const api::Call& call,
                    const v1::BackupMapRequest& in,
                    StreamSink<v1::BackupMapResponse> sink) {
  return db.maps().Backup(
      call, in.name(), [&sink](const api::BackupPiece& piece) { return sink(ToProto(piece)); });
}

}  // namespace

grpc::ServerUnaryReactor* MapsService::Create(grpc::CallbackServerContext* context,
                                              const v1::CreateMapRequest* in,
                                              v1::CreateMapResponse* out) {
  return RunUnary(runtime_, context, "Maps.Create", in, out, &server::Create);
}

grpc::ServerUnaryReactor* MapsService::Get(grpc::CallbackServerContext* context,
                                           const v1::GetMapRequest* in,
                                           v1::GetMapResponse* out) {
  return RunUnary(runtime_, context, "Maps.Get", in, out, &server::Get);
}

grpc::ServerUnaryReactor* MapsService::List(grpc::CallbackServerContext* context,
                                            const v1::ListMapsRequest* in,
                                            v1::ListMapsResponse* out) {
  return RunUnary(runtime_, context, "Maps.List", in, out, &server::List);
}

grpc::ServerUnaryReactor* MapsService::Delete(grpc::CallbackServerContext* context,
                                              const v1::DeleteMapRequest* in,
                                              v1::DeleteMapResponse* out) {
  return RunUnary(runtime_, context, "Maps.Delete", in, out, &server::Delete);
}

grpc::ServerUnaryReactor* MapsService::Stats(grpc::CallbackServerContext* context,
                                             const v1::GetMapStatsRequest* in,
                                             v1::GetMapStatsResponse* out) {
  return RunUnary(runtime_, context, "Maps.Stats", in, out, &server::Stats);
}

grpc::ServerUnaryReactor* MapsService::History(grpc::CallbackServerContext* context,
                                               const v1::GetMapHistoryRequest* in,
                                               v1::GetMapHistoryResponse* out) {
  return RunUnary(runtime_, context, "Maps.History", in, out, &server::History);
}

grpc::ServerUnaryReactor* MapsService::ListClasses(grpc::CallbackServerContext* context,
                                                   const v1::ListMapClassesRequest* in,
                                                   v1::ListMapClassesResponse* out) {
  return RunUnary(runtime_, context, "Maps.ListClasses", in, out, &server::ListClasses);
}

grpc::ServerUnaryReactor* MapsService::SetClass(grpc::CallbackServerContext* context,
                                                const v1::SetMapClassRequest* in,
                                                v1::SetMapClassResponse* out) {
  return RunUnary(runtime_, context, "Maps.SetClass", in, out, &server::SetClass);
}

grpc::ServerWriteReactor<v1::WatchMapResponse>* MapsService::Watch(
    grpc::CallbackServerContext* context, const v1::WatchMapRequest* in) {
  return StartPolling<MapWatchReactor>(runtime_, *context, *in);
}

grpc::ServerWriteReactor<v1::BackupMapResponse>* MapsService::Backup(
    grpc::CallbackServerContext* context, const v1::BackupMapRequest* in) {
  return RunStream(runtime_, context, "Maps.Backup", in, &server::Backup);
}

}  // namespace strata::server
