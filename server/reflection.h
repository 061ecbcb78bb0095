// Reflection: what services and messages there are, for general tools.
#ifndef STRATA_SERVER_REFLECTION_H_
#define STRATA_SERVER_REFLECTION_H_

#include <memory>

#include <grpcpp/security/auth_metadata_processor.h>
#include <grpcpp/server_builder.h>

#include "server/access/access.h"

namespace strata::server {

// gRPC adds the service to every builder of a process that links it; takes it out of this one.
void LeaveOutReflection(grpc::ServerBuilder& builder);

// For credentials of an encrypted listener: lets only callers that `access`, which must outlive the
// server, knows use reflection, whose service is gRPC's and asks nobody. All other calls pass:
// their services ask.
std::shared_ptr<grpc::AuthMetadataProcessor> GuardReflection(Access& access);

}  // namespace strata::server

#endif  // STRATA_SERVER_REFLECTION_H_
