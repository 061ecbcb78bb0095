// What happens to a call before anything of it is kept.
#ifndef STRATA_SERVER_DOOR_H_
#define STRATA_SERVER_DOOR_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <grpcpp/security/auth_metadata_processor.h>
#include <grpcpp/security/server_credentials.h>

#include "server/rpc/connections.h"
#include "server/rpc/refusals.h"
#include "server/rpc/runtime.h"

namespace strata::server {

// gRPC asks it on its own thread as soon as a call's metadata are there: the request of a call that
// it refuses is not read, and no handler hears of it. Refused are those whom nobody knows, but for
// few, who get on to be told why and to be logged like everybody, and calls of clients who begin
// them faster than they end; of those who go on by the hundreds the connections are cut. Health is
// for anybody. Must not outlive what it is given. Thread-safe.
class Door final : public grpc::AuthMetadataProcessor {
 public:
  // The door of the connections of one lane.
  Door(Runtime& runtime, Connections& connections, int lane)
      : runtime_(runtime), connections_(connections), lane_(lane) {}

  // What it does is as quick as another thread would be found.
  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata,
                       grpc::AuthContext* context,
                       OutputMetadata* consumed,
                       OutputMetadata* response) override;
  // `path` as in "/strata.v1.Maps/Get"; UNAUTHENTICATED, RESOURCE_EXHAUSTED.
  absl::Status Judge(absl::string_view path,
                     absl::string_view authorization,
                     absl::string_view certificate_name);

 private:
  // Whether to let it in.
  bool Take(const Arrival& arrival, absl::Time now);

  Runtime& runtime_;
  Connections& connections_;
  const int lane_;
};

// Credentials of connections in plain text, for which gRPC's C++ has no processor.
std::shared_ptr<grpc::ServerCredentials> PlainCredentials(std::shared_ptr<Door> door);

}  // namespace strata::server

#endif  // STRATA_SERVER_DOOR_H_
