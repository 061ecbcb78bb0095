// api::Classifiers over strata.v1.Classifiers.
#ifndef STRATA_CLIENT_SDK_REMOTE_CLASSIFIERS_H_
#define STRATA_CLIENT_SDK_REMOTE_CLASSIFIERS_H_

#include <memory>
#include <vector>

#include "client/sdk/connection.h"
#include "core/api/classifiers.h"
#include "strata/v1/classifiers.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteClassifiers final : public api::Classifiers {
 public:
  explicit RemoteClassifiers(Connection& connection)
      : connection_(connection), stub_(v1::Classifiers::NewStub(connection.channel())) {}

  absl::StatusOr<ClassifierInfo> Get(const api::Call& call,
                                     absl::string_view map,
                                     absl::string_view name) override;
  absl::StatusOr<std::vector<ClassifierInfo>> List(const api::Call& call,
                                                   absl::string_view map) override;
  absl::Status Delete(const api::Call& call,
                      absl::string_view map,
                      absl::string_view name) override;
  absl::Status Export(const api::Call& call,
                      absl::string_view map,
                      absl::string_view name,
                      absl::FunctionRef<absl::Status(absl::string_view)> sink) override;
  absl::StatusOr<ClassifierInfo> Import(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        absl::string_view bytes) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Classifiers::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_CLASSIFIERS_H_
