// Scans between the core's words and the wire's. FromProto answers INVALID_ARGUMENT for what the
// core's types cannot hold or its checks refuse.
#ifndef STRATA_PROTO_TRANSLATE_SCANS_H_
#define STRATA_PROTO_TRANSLATE_SCANS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/scans.h"
#include "core/world/scan.h"
#include "strata/v1/scans.pb.h"

namespace strata::translate {

v1::ScanId ToProto(const ScanId& id);
v1::ScanState ToProto(ScanState state);
v1::ScanHeader ToProto(const ScanHeader& header);
v1::ScanInfo ToProto(const ScanInfo& scan);
v1::ScanAck ToProto(const ScanAck& ack);
v1::GetUploadStateResponse ToProto(const UploadState& state);
v1::ListScansRequest ToProto(absl::string_view map, const api::ScanFilter& filter);

ScanId FromProto(const v1::ScanId& id);
absl::StatusOr<ScanState> FromProto(v1::ScanState state);
// The header passes ValidateScanHeader.
absl::StatusOr<ScanHeader> FromProto(const v1::ScanHeader& header);
absl::StatusOr<ScanInfo> FromProto(const v1::ScanInfo& scan);
ScanAck FromProto(const v1::ScanAck& ack);
UploadState FromProto(const v1::GetUploadStateResponse& state);
absl::StatusOr<api::ScanFilter> FromProto(const v1::ListScansRequest& request);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_SCANS_H_
