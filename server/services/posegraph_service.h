// strata.v1.PoseGraph over api::PoseGraph.
#ifndef STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_
#define STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/posegraph.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class PoseGraphService final : public v1::PoseGraph::CallbackService {
 public:
  explicit PoseGraphService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerWriteReactor<v1::GetPoseGraphResponse>* Get(
      grpc::CallbackServerContext* context, const v1::GetPoseGraphRequest* in) override;
  grpc::ServerUnaryReactor* SetPose(grpc::CallbackServerContext* context,
                                    const v1::SetPoseRequest* in,
                                    v1::SetPoseResponse* out) override;
  grpc::ServerUnaryReactor* AddConstraint(grpc::CallbackServerContext* context,
                                          const v1::AddConstraintRequest* in,
                                          v1::AddConstraintResponse* out) override;
  grpc::ServerUnaryReactor* RemoveConstraint(grpc::CallbackServerContext* context,
                                             const v1::RemoveConstraintRequest* in,
                                             v1::RemoveConstraintResponse* out) override;
  grpc::ServerUnaryReactor* EnableConstraint(grpc::CallbackServerContext* context,
                                             const v1::EnableConstraintRequest* in,
                                             v1::EnableConstraintResponse* out) override;
  grpc::ServerUnaryReactor* LookupPose(grpc::CallbackServerContext* context,
                                       const v1::LookupPoseRequest* in,
                                       v1::LookupPoseResponse* out) override;
  grpc::ServerReadReactor<v1::LocalizeRequest>* Localize(grpc::CallbackServerContext* context,
                                                         v1::LocalizeResponse* out) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_POSEGRAPH_SERVICE_H_
