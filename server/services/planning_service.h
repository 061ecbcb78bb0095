// strata.v1.Planning over api::Planning.
#ifndef STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_
#define STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/planning.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class PlanningService final : public v1::Planning::CallbackService {
 public:
  explicit PlanningService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* PlanPath(grpc::CallbackServerContext* context,
                                     const v1::PlanPathRequest* in,
                                     v1::PlanPathResponse* out) override;
  grpc::ServerUnaryReactor* CheckPath(grpc::CallbackServerContext* context,
                                      const v1::CheckPathRequest* in,
                                      v1::CheckPathResponse* out) override;
  grpc::ServerWriteReactor<v1::WatchPathResponse>* WatchPath(
      grpc::CallbackServerContext* context, const v1::WatchPathRequest* in) override;
  grpc::ServerUnaryReactor* SampleSurfaces(grpc::CallbackServerContext* context,
                                           const v1::SampleSurfacesRequest* in,
                                           v1::SampleSurfacesResponse* out) override;
  grpc::ServerUnaryReactor* SetProfile(grpc::CallbackServerContext* context,
                                       const v1::SetProfileRequest* in,
                                       v1::SetProfileResponse* out) override;
  grpc::ServerUnaryReactor* ListProfiles(grpc::CallbackServerContext* context,
                                         const v1::ListProfilesRequest* in,
                                         v1::ListProfilesResponse* out) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_PLANNING_SERVICE_H_
