// strata.v1.Tiles over api::Tiles.
#ifndef STRATA_SERVER_SERVICES_TILES_SERVICE_H_
#define STRATA_SERVER_SERVICES_TILES_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/tiles.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class TilesService final : public v1::Tiles::CallbackService {
 public:
  explicit TilesService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetTileRequest* in,
                                v1::GetTileResponse* out) override;
  grpc::ServerWriteReactor<v1::ListTilesResponse>* List(grpc::CallbackServerContext* context,
                                                        const v1::ListTilesRequest* in) override;
  grpc::ServerWriteReactor<v1::FetchTilesResponse>* Fetch(grpc::CallbackServerContext* context,
                                                          const v1::FetchTilesRequest* in) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_TILES_SERVICE_H_
