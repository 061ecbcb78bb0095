#include "server/services/label_collector.h"

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"
#include "server/rpc/request.h"
#include "server/services/append.h"

namespace strata::server {

absl::Status LabelCollector::Take(api::Database& db,
                                  const api::Call& call,
                                  const In& in,
                                  Booking& memory) {
  if (in.has_start() && !begun_) return Begin(db, call, in.start());
  if (in.part_case() == In::kLabels && begun_) return Add(in.labels(), memory);
  return AtTheDoor(
      absl::InvalidArgumentError(begun_ ? "labels: every message after the first has labels"
                                        : "labels: the first message is the start"));
}

absl::Status LabelCollector::Begin(api::Database& db,
                                   const api::Call& call,
                                   const v1::SetScanLabelsStart& start) {
  map_ = start.map();
  id_ = translate::FromProto(start.id());
  mode_ = start.update() ? api::LabelMode::kUpdate : api::LabelMode::kReplace;
  STRATA_ASSIGN_OR_RETURN(const ScanInfo scan, db.scans().Get(call, map_, id_));
  points_ = scan.header.point_count;
  begun_ = true;
  return absl::OkStatus();
}

absl::Status LabelCollector::Add(const std::string& bytes, Booking& memory) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> labels,
                          AtTheDoor(translate::UnpackLabels(bytes)));
  if (labels.size() > points_ - labels_.size()) {
    return AtTheDoor(absl::InvalidArgumentError(
        absl::StrCat("labels: more than the ", points_, " points of scan ", id_.ToString())));
  }
  return Append(labels, memory, labels_);
}

absl::Status LabelCollector::Finish(api::Database& db, const api::Call& call, Out& /*out*/) {
  if (!begun_) {
    return AtTheDoor(absl::InvalidArgumentError("labels: the stream ended before its start"));
  }
  return db.scans().SetLabels(call, map_, id_, labels_, mode_);
}

}  // namespace strata::server
