// Jobs.Watch: follows a job.
#ifndef STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_

#include "server/rpc/poll.h"
#include "strata/v1/jobs.grpc.pb.h"

namespace strata::server {

// Sends the job whenever it is not as it was. (api::Jobs::Watch would block a thread for as long as
// the job runs.)
class JobWatchReactor final : public PollReactor<v1::WatchJobResponse> {
 public:
  JobWatchReactor(Runtime& runtime,
                  grpc::CallbackServerContext& context,
                  const v1::WatchJobRequest& in);

 private:
  absl::StatusOr<News> Look(v1::WatchJobResponse& out) override;
  absl::string_view shutdown_message() const override;

  const v1::WatchJobRequest& in_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_
