#include "core/engine/job_runner.h"

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/status.h"
#include "core/engine/optimize.h"
#include "core/engine/optimize_settings.h"
#include "core/engine/rebuild.h"
#include "core/engine/revert.h"

namespace strata {
namespace {

// After an error of the store (a full disk, say): how long until the next try.
constexpr absl::Duration kRetryDelay = absl::Seconds(1);

}  // namespace

JobRunner::JobRunner(MapCore& core, JobBoard& jobs, Worker& worker)
    : core_(core), jobs_(jobs), worker_(worker), job_waits_(jobs.AnyQueued()), thread_([this] {
        Loop();
      }) {}

void JobRunner::JobQueued() {
  absl::MutexLock lock(&mutex_);
  job_waits_ = true;
}

absl::Status JobRunner::Run(const JobInfo& job, JobContext& context) {
  if (job.kind == kOptimizeJob) return RunOptimizeJob(core_, worker_, job, context);
  return worker_.Execute(closing_, [&](Integrator& integrator) {
    return job.kind == kRevertJob ? RunRevertJob(integrator, job, context)
                                  : RunRebuildJob(integrator, job, context);
  });
}

void JobRunner::Loop() {
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      mutex_.Await(absl::Condition(this, &JobRunner::HasWork));
      if (closed_) return;
    }
    const absl::Status done = jobs_.RunNext(
        closing_, [this](const JobInfo& job, JobContext& context) { return Run(job, context); });
    absl::MutexLock lock(&mutex_);
    job_waits_ = jobs_.AnyQueued();
    if (done.ok()) continue;
    LOG(ERROR) << "map=" << core_.name() << " job: " << done.message();
    mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay);
  }
}

void JobRunner::Close() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
  }
  closing_.Request();
  if (thread_.joinable()) thread_.join();
}

}  // namespace strata
