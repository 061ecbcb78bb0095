// strata.v1.Planning over api::Planning.
#ifndef STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_
#define STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class PlanningService final : public Service {
 public:
  explicit PlanningService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_
