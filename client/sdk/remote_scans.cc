#include "client/sdk/remote_scans.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>

#include "client/sdk/remote_upload.h"
#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

namespace {

constexpr std::size_t kLabelsPerMessage = 400'000;
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

// One attempt.
absl::Status SendLabels(Connection& connection,
                        v1::Scans::Stub& stub,
                        const api::Call& call,
                        absl::string_view map,
                        const ScanId& id,
                        std::span<const std::uint16_t> labels,
                        api::LabelMode mode) {
  AttemptContext context(connection, call);
  v1::SetScanLabelsResponse out;
  const auto writer = stub.SetLabels(context.get(), &out);
  v1::SetScanLabelsRequest message;
  message.mutable_start()->set_map(std::string(map));
  *message.mutable_start()->mutable_id() = ToProto(id);
  message.mutable_start()->set_update(mode == api::LabelMode::kUpdate);
  bool goes_on = writer->Write(message);
  for (std::size_t begin = 0; goes_on && begin < labels.size(); begin += kLabelsPerMessage) {
    const std::size_t count = std::min(kLabelsPerMessage, labels.size() - begin);
    message.set_labels(translate::PackLabels(labels.subspan(begin, count)));
    goes_on = writer->Write(message);
  }
  // The server refuses early by ending the stream; why is in its status.
  if (goes_on) writer->WritesDone();
  return StatusOf(writer->Finish(), call);
}

// One attempt.
absl::StatusOr<ScanAck> SendLocalMap(Connection& connection,
                                     v1::Scans::Stub& stub,
                                     const api::Call& call,
                                     const v1::UploadLocalMapRequest& start,
                                     absl::string_view bytes) {
  AttemptContext context(connection, call);
  v1::UploadLocalMapResponse out;
  const auto writer = stub.UploadLocalMap(context.get(), &out);
  bool goes_on = writer->Write(start);
  v1::UploadLocalMapRequest message;
  for (std::size_t begin = 0; goes_on && begin < bytes.size(); begin += kPieceBytes) {
    message.set_local_map(std::string(bytes.substr(begin, kPieceBytes)));
    goes_on = writer->Write(message);
  }
  // The server refuses early by ending the stream; why is in its status.
  if (goes_on) writer->WritesDone();
  STRATA_RETURN_IF_ERROR(StatusOf(writer->Finish(), call));
  return FromProto(out.ack());
}

}  // namespace

absl::StatusOr<std::unique_ptr<api::ScanUpload>> RemoteScans::Upload(const api::Call& call,
                                                                     absl::string_view map,
                                                                     const ScanHeader& header) {
  // A quaternion would make a rotation of what is none.
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  auto upload = std::make_unique<RemoteUpload>(connection_, *stub_, call, map, header);
  STRATA_RETURN_IF_ERROR(upload->Open());
  return upload;
}

absl::StatusOr<ScanAck> RemoteScans::UploadLocalMap(const api::Call& call,
                                                    absl::string_view map,
                                                    const ScanHeader& header,
                                                    const MlsParameters& parameters,
                                                    absl::string_view local_map) {
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  v1::UploadLocalMapRequest request;
  v1::UploadLocalMapStart& start = *request.mutable_start();
  start.set_map(std::string(map));
  *start.mutable_header() = ToProto(header);
  start.set_cell_size_m(parameters.cell_size_m);
  start.set_gap_size_m(parameters.gap_size_m);
  start.set_thickness_m(parameters.thickness_m);
  Backoff backoff = connection_.NewBackoff();
  Route<v1::Scans::Stub> route(connection_, *stub_);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    const absl::StatusOr<ScanAck> ack =
        SendLocalMap(connection_, route.stub(), call, request, local_map);
    route.Follow(ack.status(), backoff);
    if (ack.ok() || !backoff.Wait(ack.status(), call.stop)) return ack;
  }
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

absl::StatusOr<std::vector<std::uint16_t>> RemoteScans::GetFaded(const api::Call& call,
                                                                 absl::string_view map,
                                                                 const ScanId& id) {
  v1::GetFadedPointsRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  std::vector<std::uint16_t> faded;
  const auto deliver = [&faded](const v1::GetFadedPointsResponse& out) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> piece,
                            translate::UnpackLabels(out.scans()));
    faded.insert(faded.end(), piece.begin(), piece.end());
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(
      CallStream(connection_, *stub_, &v1::Scans::Stub::GetFaded, call, in, deliver));
  return faded;
}

absl::Status RemoteScans::SetLabels(const api::Call& call,
                                    absl::string_view map,
                                    const ScanId& id,
                                    const std::vector<std::uint16_t>& labels,
                                    api::LabelMode mode) {
  Backoff backoff = connection_.NewBackoff();
  Route<v1::Scans::Stub> route(connection_, *stub_);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    const absl::Status sent = SendLabels(connection_, route.stub(), call, map, id, labels, mode);
    route.Follow(sent, backoff);
    if (sent.ok() || !backoff.Wait(sent, call.stop)) return sent;
  }
}

absl::Status RemoteScans::Delete(const api::Call& call, absl::string_view map, const ScanId& id) {
  v1::DeleteScanRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  return CallUnary(connection_, *stub_, &v1::Scans::Stub::Delete, call, Repeat::kNever, in)
      .status();
}

}  // namespace strata::sdk
