#include "server/services/watch_reactor.h"

#include <chrono>

#include <google/protobuf/util/message_differencer.h>

#include "core/common/status.h"
#include "core/world/job.h"
#include "proto/translate/jobs.h"
#include "proto/translate/status.h"

namespace strata::server {
namespace {

constexpr std::chrono::milliseconds kInterval(100);

bool IsFinalState(v1::JobState state) { return IsFinal(static_cast<JobState>(state)); }

}  // namespace

WatchReactor::WatchReactor(Runtime& runtime,
                           grpc::CallbackServerContext& context,
                           const v1::WatchJobRequest& in)
    : runtime_(runtime), request_(runtime, context, "Jobs.Watch"), in_(in) {
  request_.CountReceived(in);
  if (const absl::Status admission = request_.admission(); !admission.ok()) {
    Finish(request_.Close(admission));
    return;
  }
  runtime_.queries.Submit([this] { Look(); });
}

void WatchReactor::Look() {
  absl::StatusOr<v1::Job> job = v1::Job();
  const absl::Status status = Guarded([&]() -> absl::Status {
    job = CurrentJob();
    return job.status();
  });
  if (!status.ok()) {
    Finish(request_.Close(status));
    return;
  }
  if (sent_.has_job() && google::protobuf::util::MessageDifferencer::Equals(sent_.job(), *job)) {
    WaitAndLook();
    return;
  }
  *sent_.mutable_job() = *std::move(job);
  request_.CountSent(sent_);
  StartWrite(&sent_);
}

absl::StatusOr<v1::Job> WatchReactor::CurrentJob() {
  STRATA_RETURN_IF_ERROR(request_.call().stop.status());
  if (runtime_.shutting_down) {
    return translate::WithReason(
        absl::UnavailableError("the server is shutting down; the job goes on after its restart"),
        translate::kShuttingDownReason);
  }
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          runtime_.db.jobs().Get(request_.call(), in_.map(), in_.id()));
  return translate::ToProto(job);
}

void WatchReactor::WaitAndLook() {
  // A new alarm each time: the former one's callback may still be returning.
  alarm_ = std::make_unique<grpc::Alarm>();
  alarm_->Set(std::chrono::system_clock::now() + kInterval,
              [this](bool) { runtime_.queries.Submit([this] { Look(); }); });
}

void WatchReactor::OnWriteDone(bool ok) {
  if (!ok) {
    Finish(request_.Close(absl::CancelledError("the reader has gone")));
  } else if (IsFinalState(sent_.job().state())) {
    Finish(request_.Close(absl::OkStatus()));
  } else {
    WaitAndLook();
  }
}

}  // namespace strata::server
