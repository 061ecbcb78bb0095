#include "server/services/maps_service.h"

#include "core/common/status.h"
#include "core/world/map_info.h"
#include "core/world/names.h"
#include "proto/translate/maps.h"
#include "proto/translate/watch.h"
#include "server/rpc/request.h"
#include "server/rpc/stream.h"
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

absl::Status SetOrigin(api::Database& db,
                       const api::Call& call,
                       const v1::SetMapOriginRequest& in,
                       v1::SetMapOriginResponse&) {
  if (!in.has_origin()) {
    return AtTheDoor(absl::InvalidArgumentError("origin is missing: say where on earth"));
  }
  const GeodeticOrigin origin = FromProto(in.origin());
  STRATA_RETURN_IF_ERROR(AtTheDoor(ValidateGeodeticOrigin(origin)));
  return db.maps().SetOrigin(call, in.name(), origin);
}

absl::Status Backup(api::Database& db,
                    const api::Call& call,
                    const v1::BackupMapRequest& in,
                    StreamSink<v1::BackupMapResponse> sink) {
  return db.maps().Backup(
      call, in.name(), [&sink](const api::BackupPiece& piece) { return sink(ToProto(piece)); });
}

}  // namespace

MapsService::MapsService(Runtime& runtime) : Service(runtime, "Maps") {
  Unary("Create", &Create);
  Unary("Get", &Get);
  Unary("List", &List);
  Unary("Delete", &Delete);
  Unary("Stats", &Stats);
  Unary("History", &History);
  Unary("ListClasses", &ListClasses);
  Unary("SetClass", &SetClass);
  Unary("SetOrigin", &SetOrigin);
  Poll<MapWatchReactor>("Watch");
  Stream("Backup", &Backup);
}

}  // namespace strata::server
