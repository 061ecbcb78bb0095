// api::Scans over strata.v1.Scans.
#ifndef STRATA_CLIENT_SDK_REMOTE_SCANS_H_
#define STRATA_CLIENT_SDK_REMOTE_SCANS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "client/sdk/connection.h"
#include "core/api/scans.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteScans final : public api::Scans {
 public:
  explicit RemoteScans(Connection& connection)
      : connection_(connection), stub_(v1::Scans::NewStub(connection.channel())) {}

  absl::StatusOr<std::unique_ptr<api::ScanUpload>> Upload(const api::Call& call,
                                                          absl::string_view map,
                                                          const ScanHeader& header) override;
  absl::StatusOr<ScanAck> UploadLocalMap(const api::Call& call,
                                         absl::string_view map,
                                         const ScanHeader& header,
                                         const MlsParameters& parameters,
                                         absl::string_view local_map) override;
  absl::StatusOr<UploadState> GetUploadState(const api::Call& call,
                                             absl::string_view map,
                                             absl::string_view trajectory) override;
  absl::StatusOr<ScanInfo> Get(const api::Call& call,
                               absl::string_view map,
                               const ScanId& id) override;
  absl::Status List(const api::Call& call,
                    absl::string_view map,
                    const api::ScanFilter& filter,
                    absl::FunctionRef<absl::Status(const ScanInfo&)> sink) override;
  absl::Status GetPoints(const api::Call& call,
                         absl::string_view map,
                         const ScanId& id,
                         absl::FunctionRef<absl::Status(const PointCloud&)> sink) override;
  absl::StatusOr<std::vector<std::uint16_t>> GetFaded(const api::Call& call,
                                                      absl::string_view map,
                                                      const ScanId& id) override;
  absl::Status SetLabels(const api::Call& call,
                         absl::string_view map,
                         const ScanId& id,
                         const std::vector<std::uint16_t>& labels,
                         api::LabelMode mode) override;
  absl::Status Delete(const api::Call& call, absl::string_view map, const ScanId& id) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Scans::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_SCANS_H_
