// strata.v1.Maps over api::Maps.
#ifndef STRATA_SERVER_SERVICES_MAPS_SERVICE_H_
#define STRATA_SERVER_SERVICES_MAPS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class MapsService final : public Service {
 public:
  explicit MapsService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_MAPS_SERVICE_H_
