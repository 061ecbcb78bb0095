// api::Models over strata.v1.Models.
#ifndef STRATA_CLIENT_SDK_REMOTE_MODELS_H_
#define STRATA_CLIENT_SDK_REMOTE_MODELS_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/models.h"
#include "strata/v1/models.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteModels final : public api::Models {
 public:
  explicit RemoteModels(Connection& connection)
      : connection_(connection), stub_(v1::Models::NewStub(connection.channel())) {}

  absl::StatusOr<PlaneModelInfo> GetPlaneModel(
      const api::Call& call,
      absl::string_view map,
      absl::FunctionRef<absl::Status(const ModelPlane&)> sink) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Models::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_MODELS_H_
