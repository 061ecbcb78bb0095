#include "server/services/local_map_collector.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/scans.h"
#include "server/rpc/request.h"
#include "server/services/append.h"

namespace strata::server {
namespace {

absl::Status Wrong(absl::string_view rule) {
  return AtTheDoor(absl::InvalidArgumentError(absl::StrCat("local map: ", rule)));
}

}  // namespace

absl::Status LocalMapCollector::Take(api::Database& db,
                                     const api::Call& call,
                                     const In& in,
                                     Booking& memory) {
  if (in.has_start() && !begun_) {
    const v1::UploadLocalMapStart& start = in.start();
    map_ = start.map();
    STRATA_ASSIGN_OR_RETURN(header_, AtTheDoor(translate::FromProto(start.header())));
    parameters_ = {.cell_size_m = start.cell_size_m(),
                   .gap_size_m = start.gap_size_m(),
                   .thickness_m = start.thickness_m()};
    // An unknown map is told before megabytes were sent to it.
    STRATA_RETURN_IF_ERROR(db.maps().Get(call, map_).status());
    begun_ = true;
    return absl::OkStatus();
  }
  if (in.part_case() != In::kLocalMap || !begun_) {
    return Wrong(begun_ ? "every message after the first has bytes"
                        : "the first message is the start");
  }
  if (bytes_.size() + in.local_map().size() > api::kMaxLocalMapBytes) {
    return AtTheDoor(absl::ResourceExhaustedError(absl::StrCat("scan ",
                                                               header_.id.ToString(),
                                                               ": local map of more than ",
                                                               api::kMaxLocalMapBytes,
                                                               " bytes; split it")));
  }
  return Append(in.local_map(), memory, bytes_);
}

absl::Status LocalMapCollector::Finish(api::Database& db, const api::Call& call, Out& out) {
  if (!begun_) return Wrong("the stream ended before its start");
  STRATA_ASSIGN_OR_RETURN(const ScanAck ack,
                          db.scans().UploadLocalMap(call, map_, header_, parameters_, bytes_));
  *out.mutable_ack() = translate::ToProto(ack);
  return absl::OkStatus();
}

}  // namespace strata::server
