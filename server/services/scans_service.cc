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
#include "server/rpc/stream.h"
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

ScansService::ScansService(Runtime& runtime) : Service(runtime, "Scans") {
  Receive<UploadReactor>("Upload");
  Exchange<IngestReactor>("Ingest");
  Collect<LocalMapCollector>("UploadLocalMap");
  Unary("GetUploadState", &GetUploadState);
  Unary("Get", &Get);
  Stream("List", &List);
  Stream("GetPoints", &GetPoints);
  Stream("GetFaded", &GetFaded);
  Collect<LabelCollector>("SetLabels");
  Unary("Delete", &Delete);
}

}  // namespace strata::server
