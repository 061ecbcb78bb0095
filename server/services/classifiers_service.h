// strata.v1.Classifiers over api::Classifiers.
#ifndef STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_
#define STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/classifiers.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class ClassifiersService final : public v1::Classifiers::CallbackService {
 public:
  explicit ClassifiersService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetClassifierRequest* in,
                                v1::GetClassifierResponse* out) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListClassifiersRequest* in,
                                 v1::ListClassifiersResponse* out) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteClassifierRequest* in,
                                   v1::DeleteClassifierResponse* out) override;
  grpc::ServerWriteReactor<v1::ExportClassifierResponse>* Export(
      grpc::CallbackServerContext* context, const v1::ExportClassifierRequest* in) override;
  grpc::ServerReadReactor<v1::ImportClassifierRequest>* Import(
      grpc::CallbackServerContext* context, v1::ImportClassifierResponse* out) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_CLASSIFIERS_SERVICE_H_
