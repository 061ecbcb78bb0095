// strata.v1.Models over api::Models, strata.v1.Objects over api::Objects.
#ifndef STRATA_SERVER_SERVICES_MODELS_SERVICE_H_
#define STRATA_SERVER_SERVICES_MODELS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class ModelsService final : public Service {
 public:
  explicit ModelsService(Runtime& runtime);
};

// Thread-safe.
class ObjectsService final : public Service {
 public:
  explicit ObjectsService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_MODELS_SERVICE_H_
