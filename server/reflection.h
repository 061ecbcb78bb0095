// Reflection: what services and messages there are, for general tools.
#ifndef STRATA_SERVER_REFLECTION_H_
#define STRATA_SERVER_REFLECTION_H_

#include <grpcpp/server_builder.h>

namespace strata::server {

// gRPC adds the service to every builder of a process that links it; takes it out of this one.
void LeaveOutReflection(grpc::ServerBuilder& builder);

}  // namespace strata::server

#endif  // STRATA_SERVER_REFLECTION_H_
