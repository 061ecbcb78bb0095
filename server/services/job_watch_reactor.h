// Jobs.Watch: follows a job.
#ifndef STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/time/time.h"

#include "server/rpc/poll.h"
#include "strata/v1/jobs.grpc.pb.h"

namespace strata::server {

// Sends the job whenever it is not as it was. (api::Jobs::Watch would block a thread for as long as
// the job runs.)
class JobWatchReactor final : public PollReactor<v1::WatchJobRequest, v1::WatchJobResponse> {
 public:
  JobWatchReactor(Runtime& runtime, grpc::CallbackServerContext& context, Sealed<In>& in)
      : PollReactor(runtime, context, "Jobs.Watch", in) {}

 private:
  absl::Status Ask(const In& in) override;
  absl::StatusOr<News> Look(Out& out) override;
  std::size_t kept_bytes() const override { return told_.ByteSizeLong(); }
  absl::Duration patience() const override { return absl::Seconds(10); }
  absl::string_view shutdown_message() const override;

  std::string map_;
  std::uint64_t id_ = 0;
  v1::Job told_;  // last; without an id: none was
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_JOB_WATCH_REACTOR_H_
