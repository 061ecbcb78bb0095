#include "core/engine/jobs/job_runner.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/engine/labels/fade.h"
#include "core/engine/map/engine_options.h"
#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

// Who starts jobs that nobody asked for.
constexpr absl::string_view kServer = "server";

// What there is no memory to log is not logged.
void LogError(absl::string_view event, absl::string_view map, const absl::Status& error) {
  Guarded([&] {
    LOG(ERROR) << LogLine(event).Add("map", map).Add("error", error.message());
    return absl::OkStatus();
  }).IgnoreError();
}

bool AnyUnfinished(const std::vector<JobInfo>& jobs, absl::string_view kind) {
  return std::any_of(jobs.begin(), jobs.end(), [kind](const JobInfo& job) {
    return job.kind == kind && !IsFinal(job.state);
  });
}

// Whether a job that begins has made its epoch already, and was killed before it could say so; a
// second one would not be undone with the first. If so, tells what is known.
absl::StatusOr<bool> HasMadeItsEpoch(MapCore& core, const JobInfo& job, JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<EpochInfo> epochs, reader->ListEpochs());
  for (const EpochInfo& epoch : epochs) {
    if (epoch.job != job.id) continue;
    context.SetMetric("epoch", static_cast<double>(epoch.epoch));
    context.SetMetric("epoch_before", static_cast<double>(epoch.epoch - 1));
    context.SetMessage(absl::StrCat("epoch ", epoch.epoch, " was made before a restart"));
    return true;
  }
  return false;
}

}  // namespace

JobRunner::JobRunner(
    MapCore& core, Quarantine& quarantine, JobBoard& jobs, Worker& worker, const SeenClosures& seen)
    : core_(core),
      quarantine_(quarantine),
      jobs_(jobs),
      worker_(worker),
      closures_(core, seen),
      seen_(seen),
      job_waits_(jobs.NextId().has_value()),
      next_look_(core.options().optimize_interval > absl::ZeroDuration()
                     ? SteadyNow() + core.options().optimize_interval
                     : absl::InfiniteFuture()),
      thread_([this] { Loop(); }) {}

void JobRunner::JobQueued() {
  absl::MutexLock lock(&mutex_);
  job_waits_ = true;
  look_.Request();
}

absl::Status JobRunner::Run(const JobInfo& job, JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const bool done, HasMadeItsEpoch(core_, job, context));
  if (done) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(context.stop().status());  // it was cancelled before a restart
  return RunHandler(core_, &worker_, job, context);
}

JobRunner::Step JobRunner::NextStep() {
  absl::MutexLock lock(&mutex_);
  steps_ = false;
  seen_ = closures_.seen();
  const absl::Cleanup goes_on = [this]() ABSL_NO_THREAD_SAFETY_ANALYSIS { steps_ = true; };
  // A clock that is set forward ends a wait early.
  while (!mutex_.AwaitWithTimeout(absl::Condition(this, &JobRunner::HasWork),
                                  next_look_ - SteadyNow()) &&
         SteadyNow() < next_look_) {
  }
  if (closed_) return Step::kClosed;
  if (job_waits_) return Step::kJob;
  look_ = Stop();
  return Step::kLook;
}

void JobRunner::Loop() {
  NameThisThread("job");
  YieldThisThread(10);  // uploads, integration and readers go first
  while (true) {
    const Step step = NextStep();
    if (step == Step::kClosed) return;
    const absl::Time begun = SteadyNow();
    step == Step::kJob ? RunJob() : Look();
    PlanNextLook(begun);
  }
}

absl::StatusOr<bool> JobRunner::MustWait() {
  const std::optional<std::uint64_t> next = jobs_.NextId();
  if (!next.has_value() || !quarantine_.IsSuspect({WorkKind::kJob, *next})) return false;
  return quarantine_.SuspectScanWaits();
}

void JobRunner::RunJob() {
  const absl::Status done = Guarded([this]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const bool waits, MustWait());
    if (waits) return absl::UnavailableError("a scan that the server may have died of goes first");
    return jobs_.RunNext(
        closing_, [this](const JobInfo& job, JobContext& context) { return Run(job, context); });
  });
  absl::MutexLock lock(&mutex_);
  job_waits_ = jobs_.NextId().has_value();
  if (done.ok()) return;
  LogError("job", core_.name(), done);
  mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay);
}

absl::StatusOr<bool> JobRunner::OptimizeIsDue() {
  if (AnyUnfinished(jobs_.List(), kOptimizeJob)) return false;  // which a worker runs, or will
  // Somebody has still to decide about a proposal, which another epoch would make worthless.
  if (jobs_.AnyIn(JobState::kProposed)) {
    STRATA_RETURN_IF_ERROR(jobs_.TakeIn().status());  // who may have decided elsewhere
    if (jobs_.AnyIn(JobState::kProposed)) return false;
  }
  Stop stop;
  {
    absl::MutexLock lock(&mutex_);
    stop = look_;
  }
  STRATA_ASSIGN_OR_RETURN(const std::size_t found, closures_.Look(stop));
  if (found > 0) LOG(INFO) << LogLine("closures").Add("map", core_.name()).Add("found", found);
  return found > 0;
}

absl::Status JobRunner::StartWhatIsDue() {
  const auto start_if = [this](const absl::StatusOr<bool>& due,
                               absl::string_view kind,
                               const JobParameters& parameters) -> absl::Status {
    if (!due.ok() || !*due || jobs_.LastIsQuarantined(kind)) return due.status();
    return jobs_.Start(closing_, kServer, kind, parameters).status();
  };
  STRATA_RETURN_IF_ERROR(start_if(OptimizeIsDue(), kOptimizeJob, {{"automatic", "1"}}));
  return start_if(FadingIsDue(core_, jobs_.List()), kFadeJob, {});
}

void JobRunner::Look() {
  const WorkId look{WorkKind::kLook, 0};
  if (quarantine_.IsHeld(look)) return;
  const absl::Status done = Guarded([&]() -> absl::Status {
    if (!closures_.HasNews()) return StartWhatIsDue();
    STRATA_RETURN_IF_ERROR(quarantine_.Begin(look));
    const absl::Status started = Guarded([this] { return StartWhatIsDue(); });
    STRATA_RETURN_IF_ERROR(quarantine_.End(look));
    return started;
  });
  const bool failed = !done.ok() && !absl::IsCancelled(done);
  if (failed) LogError("look", core_.name(), done);
  absl::MutexLock lock(&mutex_);
  look_failed_ = failed;
  job_waits_ = jobs_.NextId().has_value();
}

void JobRunner::PlanNextLook(absl::Time begun) {
  const absl::Duration interval = core_.options().optimize_interval;
  if (interval == absl::ZeroDuration()) return;
  const absl::Time now = SteadyNow();
  absl::MutexLock lock(&mutex_);
  next_look_ = now + std::max(interval, now - begun);
}

bool JobRunner::AtRest() const {
  const bool looks = core_.options().optimize_interval > absl::ZeroDuration() &&
                     !quarantine_.IsHeld({WorkKind::kLook, 0});
  const MapView now = core_.snapshots().current();
  absl::MutexLock lock(&mutex_);
  return !steps_ && !job_waits_ && (!looks || look_failed_ || seen_.view == now);
}

SeenClosures JobRunner::seen() const {
  absl::MutexLock lock(&mutex_);
  return seen_;
}

void JobRunner::Close() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    look_.Request();
  }
  closing_.Request();
  jobs_.StopRunning();  // a learning step does not look at closing_
  if (thread_.joinable()) thread_.join();
}

}  // namespace strata
