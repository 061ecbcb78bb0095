// The sockets under gRPC.
#ifndef STRATA_SERVER_RPC_CONNECTIONS_H_
#define STRATA_SERVER_RPC_CONNECTIONS_H_

#include "absl/strings/string_view.h"

namespace strata::server {

// Ends this process' TCP connections with `peer`, as in grpc::ServerContextBase::peer(); gRPC finds
// them broken. False if there is none. Looks at every file that is open.
bool CutConnection(absl::string_view peer);

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_CONNECTIONS_H_
