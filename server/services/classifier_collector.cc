#include "server/services/classifier_collector.h"

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/classifiers.h"
#include "server/rpc/request.h"
#include "server/services/append.h"

namespace strata::server {
namespace {

absl::Status Wrong(absl::string_view rule) {
  return AtTheDoor(absl::InvalidArgumentError(absl::StrCat("classifier: ", rule)));
}

}  // namespace

absl::Status ClassifierCollector::Take(api::Database& db,
                                       const api::Call& call,
                                       const In& in,
                                       Booking& memory) {
  if (in.has_start() && !begun_) {
    map_ = in.start().map();
    name_ = in.start().name();
    // An unknown map is told before megabytes were sent to it.
    STRATA_RETURN_IF_ERROR(db.maps().Get(call, map_).status());
    begun_ = true;
    return absl::OkStatus();
  }
  if (in.part_case() != In::kBytes || !begun_) {
    return Wrong(begun_ ? "every message after the first has bytes"
                        : "the first message is the start");
  }
  if (bytes_.size() + in.bytes().size() > kMaxClassifierBytes) {
    return AtTheDoor(absl::ResourceExhaustedError(
        absl::StrCat("classifier ", name_, ": more than ", kMaxClassifierBytes, " bytes")));
  }
  return Append(in.bytes(), memory, bytes_);
}

absl::Status ClassifierCollector::Finish(api::Database& db, const api::Call& call, Out& out) {
  if (!begun_) return Wrong("the stream ended before its start");
  STRATA_ASSIGN_OR_RETURN(const ClassifierInfo info,
                          db.classifiers().Import(call, map_, name_, bytes_));
  *out.mutable_classifier() = translate::ToProto(info);
  return absl::OkStatus();
}

}  // namespace strata::server
