// Jobs.Watch: follows a job without holding a thread.
#ifndef STRATA_SERVER_SERVICES_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_WATCH_REACTOR_H_

#include <memory>
#include <string>

#include <grpcpp/alarm.h>

#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "strata/v1/jobs.grpc.pb.h"

namespace strata::server {

// api::Jobs::Watch would block a thread a watcher for as long as the job runs; instead the job is
// looked up ten times a second and sent when it changed. Lives from the call's arrival to its end;
// owns itself.
class WatchReactor final : public grpc::ServerWriteReactor<v1::WatchJobResponse> {
 public:
  WatchReactor(Runtime& runtime,
               grpc::CallbackServerContext& context,
               const v1::WatchJobRequest& in);

 private:
  // One look, on a query thread; then exactly one of: a message, a wait, the end.
  void Look();
  absl::StatusOr<v1::Job> CurrentJob();
  void WaitAndLook();
  void OnWriteDone(bool ok) override;
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override { delete this; }

  Runtime& runtime_;
  Request request_;
  const v1::WatchJobRequest& in_;
  v1::WatchJobResponse sent_;  // nothing yet: no job
  std::unique_ptr<grpc::Alarm> alarm_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_WATCH_REACTOR_H_
