// strata.v1.Jobs over api::Jobs.
#ifndef STRATA_SERVER_SERVICES_JOBS_SERVICE_H_
#define STRATA_SERVER_SERVICES_JOBS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class JobsService final : public Service {
 public:
  explicit JobsService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_JOBS_SERVICE_H_
