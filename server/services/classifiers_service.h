// strata.v1.Classifiers over api::Classifiers.
#ifndef STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_
#define STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "server/rpc/service.h"

namespace strata::server {

// Thread-safe.
class ClassifiersService final : public Service {
 public:
  explicit ClassifiersService(Runtime& runtime);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_
