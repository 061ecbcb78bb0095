#include "server/services/classifiers_service.h"

#include <string>
#include <vector>

#include "core/common/status.h"
#include "proto/translate/classifiers.h"
#include "server/rpc/collect.h"
#include "server/rpc/stream.h"
#include "server/rpc/unary.h"
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

grpc::ServerUnaryReactor* ClassifiersService::Get(grpc::CallbackServerContext* context,
                                                  const v1::GetClassifierRequest* in,
                                                  v1::GetClassifierResponse* out) {
  return RunUnary(runtime_, context, "Classifiers.Get", in, out, &server::Get);
}

grpc::ServerUnaryReactor* ClassifiersService::List(grpc::CallbackServerContext* context,
                                                   const v1::ListClassifiersRequest* in,
                                                   v1::ListClassifiersResponse* out) {
  return RunUnary(runtime_, context, "Classifiers.List", in, out, &server::List);
}

grpc::ServerUnaryReactor* ClassifiersService::Delete(grpc::CallbackServerContext* context,
                                                     const v1::DeleteClassifierRequest* in,
                                                     v1::DeleteClassifierResponse* out) {
  return RunUnary(runtime_, context, "Classifiers.Delete", in, out, &server::Delete);
}

grpc::ServerWriteReactor<v1::ExportClassifierResponse>* ClassifiersService::Export(
    grpc::CallbackServerContext* context, const v1::ExportClassifierRequest* in) {
  return RunStream(runtime_, context, "Classifiers.Export", in, &server::Export);
}

grpc::ServerReadReactor<v1::ImportClassifierRequest>* ClassifiersService::Import(
    grpc::CallbackServerContext* context, v1::ImportClassifierResponse* out) {
  return new CollectReactor<ClassifierCollector>(runtime_, *context, "Classifiers.Import", *out);
}

}  // namespace strata::server
