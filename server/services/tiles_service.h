// strata.v1.Tiles over api::Tiles.
#ifndef STRATA_SERVER_SERVICES_TILES_SERVICE_H_
#define STRATA_SERVER_SERVICES_TILES_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class TilesService final : public Service {
 public:
  explicit TilesService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_TILES_SERVICE_H_
