#include "server/services/job_watch_reactor.h"

#include <utility>

#include <google/protobuf/util/message_differencer.h>

#include "core/common/status.h"
#include "core/world/job.h"
#include "proto/translate/jobs.h"

namespace strata::server {

absl::Status JobWatchReactor::Ask(const In& in) {
  map_ = in.map();
  id_ = in.id();
  return absl::OkStatus();
}

absl::StatusOr<JobWatchReactor::News> JobWatchReactor::Look(Out& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo info, runtime().db.jobs().Get(request().call(), map_, id_));
  v1::Job job = translate::ToProto(info);
  if (google::protobuf::util::MessageDifferencer::Equals(told_, job)) return News::kNone;
  told_ = job;
  *out.mutable_job() = std::move(job);
  return IsFinal(info.state) ? News::kLast : News::kSome;
}

absl::string_view JobWatchReactor::shutdown_message() const {
  return "the server is shutting down; the job goes on after its restart";
}

}  // namespace strata::server
