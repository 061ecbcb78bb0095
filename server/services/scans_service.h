// strata.v1.Scans over api::Scans.
#ifndef STRATA_SERVER_SERVICES_SCANS_SERVICE_H_
#define STRATA_SERVER_SERVICES_SCANS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class ScansService final : public Service {
 public:
  explicit ScansService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_SCANS_SERVICE_H_
