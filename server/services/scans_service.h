// strata.v1.Scans over api::Scans.
#ifndef STRATA_SERVER_SERVICES_SCANS_SERVICE_H_
#define STRATA_SERVER_SERVICES_SCANS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class ScansService final : public v1::Scans::CallbackService {
 public:
  explicit ScansService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerReadReactor<v1::UploadScanRequest>* Upload(grpc::CallbackServerContext* context,
                                                         v1::UploadScanResponse* out) override;
  grpc::ServerBidiReactor<v1::IngestScansRequest, v1::IngestScansResponse>* Ingest(
      grpc::CallbackServerContext* context) override;
  grpc::ServerReadReactor<v1::UploadLocalMapRequest>* UploadLocalMap(
      grpc::CallbackServerContext* context, v1::UploadLocalMapResponse* out) override;
  grpc::ServerUnaryReactor* GetUploadState(grpc::CallbackServerContext* context,
                                           const v1::GetUploadStateRequest* in,
                                           v1::GetUploadStateResponse* out) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetScanRequest* in,
                                v1::GetScanResponse* out) override;
  grpc::ServerWriteReactor<v1::ListScansResponse>* List(grpc::CallbackServerContext* context,
                                                        const v1::ListScansRequest* in) override;
  grpc::ServerWriteReactor<v1::GetScanPointsResponse>* GetPoints(
      grpc::CallbackServerContext* context, const v1::GetScanPointsRequest* in) override;
  grpc::ServerWriteReactor<v1::GetFadedPointsResponse>* GetFaded(
      grpc::CallbackServerContext* context, const v1::GetFadedPointsRequest* in) override;
  grpc::ServerReadReactor<v1::SetScanLabelsRequest>* SetLabels(
      grpc::CallbackServerContext* context, v1::SetScanLabelsResponse* out) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteScanRequest* in,
                                   v1::DeleteScanResponse* out) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_SCANS_SERVICE_H_
