// api::Objects over strata.v1.Objects.
#ifndef STRATA_CLIENT_SDK_REMOTE_OBJECTS_H_
#define STRATA_CLIENT_SDK_REMOTE_OBJECTS_H_

#include <memory>
#include <vector>

#include "client/sdk/connection.h"
#include "core/api/objects.h"
#include "strata/v1/objects.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteObjects final : public api::Objects {
 public:
  explicit RemoteObjects(Connection& connection)
      : connection_(connection), stub_(v1::Objects::NewStub(connection.channel())) {}

  absl::StatusOr<EntitiesInfo> ListEntities(
      const api::Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const Entity&)> sink) override;

  absl::StatusOr<std::vector<KindInfo>> ListKinds(const api::Call& call,
                                                  absl::string_view map) override;
  absl::StatusOr<ThingKind> GetKind(const api::Call& call,
                                    absl::string_view map,
                                    absl::string_view kind) override;
  absl::StatusOr<KindInfo> RenameKind(const api::Call& call,
                                      absl::string_view map,
                                      absl::string_view kind,
                                      absl::string_view name) override;
  absl::StatusOr<KindInfo> ImportKind(const api::Call& call,
                                      absl::string_view map,
                                      const NewKind& kind) override;
  absl::Status DeleteKind(const api::Call& call,
                          absl::string_view map,
                          absl::string_view kind) override;

  absl::StatusOr<InferredInfo> ListInferred(
      const api::Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const InferredPart&)> sink) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Objects::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_OBJECTS_H_
