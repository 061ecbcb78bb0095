// strata.v1.PoseGraph over api::PoseGraph.
#ifndef STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_
#define STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class PoseGraphService final : public Service {
 public:
  explicit PoseGraphService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_
