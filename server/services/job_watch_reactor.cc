#include "server/services/job_watch_reactor.h"

#include <utility>

#include <google/protobuf/util/message_differencer.h>

#include "core/common/status.h"
#include "core/world/job.h"
#include "proto/translate/jobs.h"

namespace strata::server {

JobWatchReactor::JobWatchReactor(Runtime& runtime,
                                 grpc::CallbackServerContext& context,
                                 const v1::WatchJobRequest& in)
    : PollReactor(runtime, context, "Jobs.Watch", in), in_(in) {}

absl::StatusOr<JobWatchReactor::News> JobWatchReactor::Look(v1::WatchJobResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo info,
                          runtime().db.jobs().Get(request().call(), in_.map(), in_.id()));
  v1::Job job = translate::ToProto(info);
  if (out.has_job() && google::protobuf::util::MessageDifferencer::Equals(out.job(), job)) {
    return News::kNone;
  }
  *out.mutable_job() = std::move(job);
  return IsFinal(info.state) ? News::kLast : News::kSome;
}

absl::string_view JobWatchReactor::shutdown_message() const {
  return "the server is shutting down; the job goes on after its restart";
}

}  // namespace strata::server
