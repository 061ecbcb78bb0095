#include "server/services/classifiers_service.h"

#include <string>
#include <vector>

#include "core/common/status.h"
#include "proto/translate/classifiers.h"
#include "server/rpc/stream.h"
#include "server/services/classifier_collector.h"

namespace strata::server {
namespace {

using translate::ToProto;

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetClassifierRequest& in,
                 v1::GetClassifierResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const ClassifierInfo info,
                          db.classifiers().Get(call, in.map(), in.name()));
  *out.mutable_classifier() = ToProto(info);
  return absl::OkStatus();
}

absl::Status List(api::Database& db,
                  const api::Call& call,
                  const v1::ListClassifiersRequest& in,
                  v1::ListClassifiersResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ClassifierInfo> all,
                          db.classifiers().List(call, in.map()));
  for (const ClassifierInfo& info : all) *out.add_classifiers() = ToProto(info);
  return absl::OkStatus();
}

absl::Status Delete(api::Database& db,
                    const api::Call& call,
                    const v1::DeleteClassifierRequest& in,
                    v1::DeleteClassifierResponse&) {
  return db.classifiers().Delete(call, in.map(), in.name());
}

absl::Status Export(api::Database& db,
                    const api::Call& call,
                    const v1::ExportClassifierRequest& in,
                    StreamSink<v1::ExportClassifierResponse> sink) {
  return db.classifiers().Export(call, in.map(), in.name(), [&sink](absl::string_view piece) {
    v1::ExportClassifierResponse out;
    out.set_bytes(std::string(piece));
    return sink(out);
  });
}

}  // namespace

ClassifiersService::ClassifiersService(Runtime& runtime) : Service(runtime, "Classifiers") {
  Unary("Get", &Get);
  Unary("List", &List);
  Unary("Delete", &Delete);
  Stream("Export", &Export);
  Collect<ClassifierCollector>("Import");
}

}  // namespace strata::server
