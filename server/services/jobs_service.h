// strata.v1.Jobs over api::Jobs.
#ifndef STRATA_SERVER_SERVICES_JOBS_SERVICE_H_
#define STRATA_SERVER_SERVICES_JOBS_SERVICE_H_

#include "server/rpc/runtime.h"
#include "strata/v1/jobs.grpc.pb.h"

namespace strata::server {

// Thread-safe.
class JobsService final : public v1::Jobs::CallbackService {
 public:
  explicit JobsService(Runtime& runtime) : runtime_(runtime) {}

  grpc::ServerUnaryReactor* Start(grpc::CallbackServerContext* context,
                                  const v1::StartJobRequest* in,
                                  v1::StartJobResponse* out) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetJobRequest* in,
                                v1::GetJobResponse* out) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListJobsRequest* in,
                                 v1::ListJobsResponse* out) override;
  grpc::ServerUnaryReactor* Cancel(grpc::CallbackServerContext* context,
                                   const v1::CancelJobRequest* in,
                                   v1::CancelJobResponse* out) override;
  grpc::ServerUnaryReactor* Accept(grpc::CallbackServerContext* context,
                                   const v1::AcceptJobRequest* in,
                                   v1::AcceptJobResponse* out) override;
  grpc::ServerUnaryReactor* Revert(grpc::CallbackServerContext* context,
                                   const v1::RevertJobRequest* in,
                                   v1::RevertJobResponse* out) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* Watch(grpc::CallbackServerContext* context,
                                                        const v1::WatchJobRequest* in) override;

 private:
  Runtime& runtime_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_JOBS_SERVICE_H_
