// strata.v1.Maps over api::Maps.
#ifndef STRATA_SERVER_SERVICES_MAPS_SERVICE_H_
#define STRATA_SERVER_SERVICES_MAPS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/maps.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class MapsService final : public v1::Maps::CallbackService {
 public:
  explicit MapsService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* Create(grpc::CallbackServerContext* context,
                                   const v1::CreateMapRequest* in,
                                   v1::CreateMapResponse* out) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetMapRequest* in,
                                v1::GetMapResponse* out) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListMapsRequest* in,
                                 v1::ListMapsResponse* out) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteMapRequest* in,
                                   v1::DeleteMapResponse* out) override;
  grpc::ServerUnaryReactor* Stats(grpc::CallbackServerContext* context,
                                  const v1::GetMapStatsRequest* in,
                                  v1::GetMapStatsResponse* out) override;
  grpc::ServerUnaryReactor* History(grpc::CallbackServerContext* context,
                                    const v1::GetMapHistoryRequest* in,
                                    v1::GetMapHistoryResponse* out) override;
  grpc::ServerUnaryReactor* ListClasses(grpc::CallbackServerContext* context,
                                        const v1::ListMapClassesRequest* in,
                                        v1::ListMapClassesResponse* out) override;
  grpc::ServerUnaryReactor* SetClass(grpc::CallbackServerContext* context,
                                     const v1::SetMapClassRequest* in,
                                     v1::SetMapClassResponse* out) override;
  grpc::ServerWriteReactor<v1::BackupMapResponse>* Backup(grpc::CallbackServerContext* context,
                                                          const v1::BackupMapRequest* in) override;
  grpc::ServerWriteReactor<v1::WatchMapResponse>* Watch(grpc::CallbackServerContext* context,
                                                        const v1::WatchMapRequest* in) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_MAPS_SERVICE_H_
