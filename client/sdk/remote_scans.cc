#include "client/sdk/remote_scans.h"

#include <string>

#include "client/sdk/remote_upload.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

absl::StatusOr<std::unique_ptr<api::ScanUpload>> RemoteScans::Upload(const api::Call& call,
                                                                     absl::string_view map,
                                                                     const ScanHeader& header) {
  // A quaternion would make a rotation of what is none.
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  auto upload = std::make_unique<RemoteUpload>(connection_, *stub_, call, map, header);
  STRATA_RETURN_IF_ERROR(upload->Open());
  return upload;
}

absl::StatusOr<UploadState> RemoteScans::GetUploadState(const api::Call& call,
                                                        absl::string_view map,
                                                        absl::string_view trajectory) {
  v1::GetUploadStateRequest in;
  in.set_map(std::string(map));
  in.set_trajectory(std::string(trajectory));
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetUploadStateResponse out,
      CallUnary(
          connection_, *stub_, &v1::Scans::Stub::GetUploadState, call, Repeat::kOnTrouble, in));
  return FromProto(out);
}

absl::StatusOr<ScanInfo> RemoteScans::Get(const api::Call& call,
                                          absl::string_view map,
                                          const ScanId& id) {
  v1::GetScanRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetScanResponse out,
      CallUnary(connection_, *stub_, &v1::Scans::Stub::Get, call, Repeat::kOnTrouble, in));
  return FromProto(out.scan());
}

absl::Status RemoteScans::List(const api::Call& call,
                               absl::string_view map,
                               const api::ScanFilter& filter,
                               absl::FunctionRef<absl::Status(const ScanInfo&)> sink) {
  const auto deliver = [&sink](const v1::ListScansResponse& out) -> absl::Status {
    for (const v1::ScanInfo& scan : out.scans()) {
      STRATA_ASSIGN_OR_RETURN(const ScanInfo info, FromProto(scan));
      STRATA_RETURN_IF_ERROR(sink(info));
    }
    return absl::OkStatus();
  };
  return CallStream(
      connection_, *stub_, &v1::Scans::Stub::List, call, ToProto(map, filter), deliver);
}

absl::Status RemoteScans::GetPoints(const api::Call& call,
                                    absl::string_view map,
                                    const ScanId& id,
                                    absl::FunctionRef<absl::Status(const PointCloud&)> sink) {
  v1::GetScanPointsRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  const auto deliver = [&sink](const v1::GetScanPointsResponse& out) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const PointCloud piece, FromProto(out.chunk()));
    return sink(piece);
  };
  return CallStream(connection_, *stub_, &v1::Scans::Stub::GetPoints, call, in, deliver);
}

absl::Status RemoteScans::Delete(const api::Call& call, absl::string_view map, const ScanId& id) {
  v1::DeleteScanRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  return CallUnary(connection_, *stub_, &v1::Scans::Stub::Delete, call, Repeat::kNever, in)
      .status();
}

}  // namespace strata::sdk
