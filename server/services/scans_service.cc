#include "server/services/scans_service.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/common/status.h"
#include "core/world/scan.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"
#include "server/rpc/collect.h"
#include "server/rpc/stream.h"
#include "server/rpc/unary.h"
#include "server/services/ingest_reactor.h"
#include "server/services/label_collector.h"
#include "server/services/local_map_collector.h"
#include "server/services/upload_reactor.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

constexpr int kMaxScansPerMessage = 256;

absl::Status GetUploadState(api::Database& db,
                            const api::Call& call,
                            const v1::GetUploadStateRequest& in,
                            v1::GetUploadStateResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const UploadState state,
                          db.scans().GetUploadState(call, in.map(), in.trajectory()));
  out = ToProto(state);
  return absl::OkStatus();
}

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetScanRequest& in,
                 v1::GetScanResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const ScanInfo scan, db.scans().Get(call, in.map(), FromProto(in.id())));
  *out.mutable_scan() = ToProto(scan);
  return absl::OkStatus();
}

absl::Status List(api::Database& db,
                  const api::Call& call,
                  const v1::ListScansRequest& in,
                  StreamSink<v1::ListScansResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const api::ScanFilter filter, AtTheDoor(FromProto(in)));
  v1::ListScansResponse out;
  const auto collect = [&out, &sink](const ScanInfo& scan) {
    *out.add_scans() = ToProto(scan);
    if (out.scans_size() < kMaxScansPerMessage) return absl::OkStatus();
    absl::Status sent = sink(out);
    out.clear_scans();
    return sent;
  };
  STRATA_RETURN_IF_ERROR(db.scans().List(call, in.map(), filter, collect));
  return out.scans().empty() ? absl::OkStatus() : sink(out);
}

absl::Status GetPoints(api::Database& db,
                       const api::Call& call,
                       const v1::GetScanPointsRequest& in,
                       StreamSink<v1::GetScanPointsResponse> sink) {
  return db.scans().GetPoints(call, in.map(), FromProto(in.id()), [&sink](const PointCloud& piece) {
    v1::GetScanPointsResponse out;
    *out.mutable_chunk() = ToProto(piece);
    return sink(out);
  });
}

absl::Status GetFaded(api::Database& db,
                      const api::Call& call,
                      const v1::GetFadedPointsRequest& in,
                      StreamSink<v1::GetFadedPointsResponse> sink) {
  constexpr std::size_t kMostInMessage = 500'000;
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> faded,
                          db.scans().GetFaded(call, in.map(), FromProto(in.id())));
  for (std::size_t begin = 0; begin < faded.size(); begin += kMostInMessage) {
    v1::GetFadedPointsResponse out;
    out.set_scans(translate::PackLabels(
        std::span(faded).subspan(begin, std::min(kMostInMessage, faded.size() - begin))));
    STRATA_RETURN_IF_ERROR(sink(out));
  }
  return absl::OkStatus();
}

absl::Status Delete(api::Database& db,
                    const api::Call& call,
                    const v1::DeleteScanRequest& in,
                    v1::DeleteScanResponse&) {
  return db.scans().Delete(call, in.map(), FromProto(in.id()));
}

}  // namespace

grpc::ServerReadReactor<v1::UploadScanRequest>* ScansService::Upload(
    grpc::CallbackServerContext* context, v1::UploadScanResponse* out) {
  return new UploadReactor(runtime_, *context, *out);
}

grpc::ServerBidiReactor<v1::IngestScansRequest, v1::IngestScansResponse>* ScansService::Ingest(
    grpc::CallbackServerContext* context) {
  return new IngestReactor(runtime_, *context);
}

grpc::ServerReadReactor<v1::UploadLocalMapRequest>* ScansService::UploadLocalMap(
    grpc::CallbackServerContext* context, v1::UploadLocalMapResponse* out) {
  return new CollectReactor<LocalMapCollector>(runtime_, *context, "Scans.UploadLocalMap", *out);
}

grpc::ServerUnaryReactor* ScansService::GetUploadState(grpc::CallbackServerContext* context,
                                                       const v1::GetUploadStateRequest* in,
                                                       v1::GetUploadStateResponse* out) {
  return RunUnary(runtime_, context, "Scans.GetUploadState", in, out, &server::GetUploadState);
}

grpc::ServerUnaryReactor* ScansService::Get(grpc::CallbackServerContext* context,
                                            const v1::GetScanRequest* in,
                                            v1::GetScanResponse* out) {
  return RunUnary(runtime_, context, "Scans.Get", in, out, &server::Get);
}

grpc::ServerWriteReactor<v1::ListScansResponse>* ScansService::List(
    grpc::CallbackServerContext* context, const v1::ListScansRequest* in) {
  return RunStream(runtime_, context, "Scans.List", in, &server::List);
}

grpc::ServerWriteReactor<v1::GetScanPointsResponse>* ScansService::GetPoints(
    grpc::CallbackServerContext* context, const v1::GetScanPointsRequest* in) {
  return RunStream(runtime_, context, "Scans.GetPoints", in, &server::GetPoints);
}

grpc::ServerWriteReactor<v1::GetFadedPointsResponse>* ScansService::GetFaded(
    grpc::CallbackServerContext* context, const v1::GetFadedPointsRequest* in) {
  return RunStream(runtime_, context, "Scans.GetFaded", in, &server::GetFaded);
}

grpc::ServerReadReactor<v1::SetScanLabelsRequest>* ScansService::SetLabels(
    grpc::CallbackServerContext* context, v1::SetScanLabelsResponse* out) {
  return new CollectReactor<LabelCollector>(runtime_, *context, "Scans.SetLabels", *out);
}

grpc::ServerUnaryReactor* ScansService::Delete(grpc::CallbackServerContext* context,
                                               const v1::DeleteScanRequest* in,
                                               v1::DeleteScanResponse* out) {
  return RunUnary(runtime_, context, "Scans.Delete", in, out, &server::Delete);
}

}  // namespace strata::server
