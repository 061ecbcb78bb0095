#include "core/engine/jobs/jobs_elsewhere.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/random/random.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/storage/outcome.h"

namespace strata {
namespace {

constexpr absl::Duration kProgressInterval = absl::Seconds(2);
constexpr absl::Duration kLookInterval = absl::Seconds(1);
constexpr absl::Duration kClosingPoll = absl::Milliseconds(100);
// So long a job that has published waits for who has the map.
constexpr absl::Duration kLongestTelling = absl::Seconds(10);
constexpr absl::Duration kTellingPoll = absl::Milliseconds(20);

std::string NewRunBy(const std::string& holder) {
  absl::BitGen random;
  return absl::StrCat(holder, "/", absl::Hex(absl::Uniform<std::uint64_t>(random)));
}

// What the job has been given to another, or is not any more.
bool IsLost(const absl::Status& status) {
  return absl::IsNotFound(status) || (MustBeOpenedAnew(status) && !IsOutcomeUnknown(status));
}

// The context of a job that runs beside who has its map.
class BesideContext final : public JobContext {
 public:
  BesideContext(
      MapCore& core, std::uint64_t id, const Stop& stop, const Stop& closing, JobResult& result)
      : core_(core), id_(id), stop_(stop), closing_(closing), result_(result) {}

  absl::Status Progress(double progress, absl::string_view phase) override {
    STRATA_RETURN_IF_ERROR(closing_.status());
    STRATA_RETURN_IF_ERROR(stop_.status());
    const absl::Time now = SteadyNow();
    if (now - stored_ < kProgressInterval) return absl::OkStatus();
    stored_ = now;
    // For people; losing it is no reason to end the job.
    core_.writer()
        .Run(Durability::kRelaxed,
             0,
             stop_,
             [&](StorageWriter& writer) {
               return ChangeStoredJob(writer,
                                      id_,
                                      [&](JobInfo& job, StorageWriter&) {
                                        job.progress = progress;
                                        job.phase = std::string(phase);
                                        return absl::OkStatus();
                                      })
                   .status();
             })
        .IgnoreError();
    return absl::OkStatus();
  }
  const Stop& stop() const override { return stop_; }
  void SetMetric(const std::string& name, double value) override { result_.metrics[name] = value; }
  void SetMessage(std::string message) override { result_.message = std::move(message); }
  void SetProposed() override { result_.proposed = true; }
  void SetAccepted() override { result_.accepted = true; }

 private:
  MapCore& core_;
  const std::uint64_t id_;
  const Stop stop_;
  const Stop& closing_;
  JobResult& result_;
  absl::Time stored_ = SteadyNow();
};

// Ends a run that was told to end wherever, that has been given to another, or whose engine closes.
class RunWatch {
 public:
  RunWatch(
      MapCore& core, std::uint64_t id, std::string run_by, const Stop& stop, const Stop& closing)
      : core_(core),
        id_(id),
        run_by_(std::move(run_by)),
        stop_(stop),
        closing_(closing),
        thread_([this] { Loop(); }) {}
  ~RunWatch() {
    {
      absl::MutexLock lock(&mutex_);
      over_ = true;
    }
    thread_.join();
  }
  RunWatch(const RunWatch&) = delete;
  RunWatch& operator=(const RunWatch&) = delete;

 private:
  void Loop() {
    NameThisThread("job watch");
    absl::Time next_look = SteadyNow() + kLookInterval;
    while (true) {
      {
        absl::MutexLock lock(&mutex_);
        if (mutex_.AwaitWithTimeout(absl::Condition(&over_), kClosingPoll)) return;
      }
      if (closing_.requested()) stop_.Request();
      if (SteadyNow() < next_look) continue;
      // An error: the store is away, and what it says then is told at the next look.
      Guarded([this] { return Look(); }).IgnoreError();
      next_look = SteadyNow() + kLookInterval;
    }
  }
  absl::Status Look() {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job, reader->FindJob(id_));
    const bool mine = job.has_value() && RunsElsewhere(*job) && RunBy(*job) == run_by_;
    if (!mine || IsToldToEnd(*job)) stop_.Request();
    return absl::OkStatus();
  }

  MapCore& core_;
  const std::uint64_t id_;
  const std::string run_by_;
  const Stop stop_;
  const Stop& closing_;
  absl::Mutex mutex_;
  bool over_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

// Whoever sees that the job has ended is shown what it published, wherever he asks: so it ends when
// who has the map has told of that. Where nobody has it, or is busy, it is told later.
void AwaitTold(MapCore& core, const Stop& stop) {
  const std::uint64_t asked = core.asked_to_tell();
  const absl::Time end = SteadyNow() + kLongestTelling;
  const auto is_told = [&]() -> absl::StatusOr<bool> {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(const std::optional<absl::Status> told, reader->FindAnswer(asked));
    return told.has_value();
  };
  while (asked > 0 && SteadyNow() < end && !stop.requested()) {
    const absl::StatusOr<bool> told = is_told();
    if (!told.ok()) return;
    if (*told) {
      core.writer()
          .Run(Durability::kRelaxed,
               0,
               stop,
               [asked](StorageWriter& writer) { return writer.ForgetEdit(asked); })
          .IgnoreError();  // who asks next does, an hour later
      return;
    }
    absl::SleepFor(kTellingPoll);
  }
}

}  // namespace

JobsElsewhere::JobsElsewhere(const EngineOptions& options,
                             const MapStores& stores,
                             std::shared_ptr<CacheBudget> caches,
                             std::string holder,
                             std::function<bool(const std::string&)> is_open)
    : options_(options),
      stores_(stores),
      caches_(std::move(caches)),
      holder_(std::move(holder)),
      is_open_(std::move(is_open)),
      thread_([this] { Loop(); }) {}

JobsElsewhere::~JobsElsewhere() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
  }
  closing_.Request();
  thread_.join();
}

bool JobsElsewhere::Pause() {
  absl::MutexLock lock(&mutex_);
  return !mutex_.AwaitWithTimeout(absl::Condition(&closed_), options_.look_interval);
}

void JobsElsewhere::Loop() {
  NameThisThread("job elsewhere");
  YieldThisThread(10);  // uploads, integration and readers go first
  do {
    absl::StatusOr<bool> ran = true;
    while (ran.ok() && *ran && !closing_.requested()) {
      ran = Guarded([this] { return RunNext(); });
    }
  } while (Pause());
}

absl::StatusOr<bool> JobsElsewhere::RunNext() {
  STRATA_ASSIGN_OR_RETURN(const std::vector<UnfinishedJob> jobs, stores_.ListUnfinishedJobs());
  std::set<std::string> alive;
  if (std::ranges::any_of(jobs, [](const UnfinishedJob& job) { return !job.run_by.empty(); })) {
    STRATA_ASSIGN_OR_RETURN(alive, stores_.ListWorkers());
  }
  alive.erase(holder_);  // it runs none now: what says so is of an earlier life
  for (const UnfinishedJob& job : jobs) {
    const bool waits = job.state == JobState::kQueued ||
                       (!job.run_by.empty() && !alive.contains(HolderOf(job.run_by)));
    // Those of an earlier life of this server nobody else takes for dead.
    const bool mine = HolderOf(job.run_by) == holder_;
    if (!waits || !RunsAnywhere(job.kind) || job.accepted) continue;
    if (is_open_(job.map) && !mine) continue;
    const std::string run_by = NewRunBy(holder_);
    STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> taken, Take(job, run_by));
    if (!taken.has_value()) continue;
    LOG(INFO) << LogLine("job").Add("map", job.map).Add("elsewhere", job.id).Add("kind", job.kind);
    STRATA_RETURN_IF_ERROR(Run(job, *taken, run_by));
    return true;
  }
  return false;
}

absl::StatusOr<std::optional<JobInfo>> JobsElsewhere::Take(const UnfinishedJob& job,
                                                           const std::string& run_by) {
  STRATA_ASSIGN_OR_RETURN(const StoredMap stored, stores_.OpenToWork(job.map, job.id, ""));
  StorageWriter& writer = stored.storage->writer();
  std::optional<JobInfo> taken;
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    taken.reset();
    STRATA_ASSIGN_OR_RETURN(std::vector<JobInfo> all, writer.reader().ListJobs());
    const auto runs = [&](const JobInfo& one) {
      return one.id != job.id && one.state == JobState::kRunning;
    };
    const auto found = std::ranges::find(all, job.id, &JobInfo::id);
    if (found == all.end() || std::ranges::any_of(all, runs)) return absl::OkStatus();
    const bool dead = RunsElsewhere(*found) && RunBy(*found) == job.run_by;
    if (dead) STRATA_RETURN_IF_ERROR(ReturnDeadJob(*found, writer));
    if (found->state == JobState::kQueued && RunsAnywhere(*found)) {
      found->state = JobState::kRunning;
      found->parameters[kRunBy] = run_by;
      taken = *found;
    } else if (!dead) {
      return absl::OkStatus();
    }
    found->updated = NowInMicros();
    return writer.PutJob(*found);
  }));
  return taken;
}

absl::Status JobsElsewhere::Compute(const UnfinishedJob& job,
                                    const JobInfo& taken,
                                    const std::string& run_by,
                                    const Stop& stop,
                                    JobResult& result) {
  if (IsToldToEnd(taken)) return absl::CancelledError("it was cancelled before it was run here");
  STRATA_ASSIGN_OR_RETURN(StoredMap stored, stores_.OpenToWork(job.map, job.id, run_by));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<MapCore> core,
                          MapCore::OpenBeside(job.map, std::move(stored), options_, caches_));
  BesideContext context(*core, job.id, stop, closing_, result);
  const RunWatch watch(*core, job.id, run_by, stop, closing_);
  STRATA_RETURN_IF_ERROR(RunHandler(*core, nullptr, taken, context));
  AwaitTold(*core, stop);
  return absl::OkStatus();
}

absl::Status JobsElsewhere::Run(const UnfinishedJob& job,
                                const JobInfo& taken,
                                const std::string& run_by) {
  const Stop stop;
  JobResult result;
  absl::Status ended = Guarded([&] { return Compute(job, taken, run_by, stop, result); });
  bool again = closing_.requested() && !ended.ok();
  if (absl::IsUnavailable(ended)) {  // the store was away, which is no fault of the job
    again = again || !stop.requested();
    if (stop.requested()) ended = absl::CancelledError(ended.message());
  }
  STRATA_RETURN_IF_ERROR(RecordEnd(job, run_by, ended, result, again));
  return again ? absl::UnavailableError(ended.message()) : absl::OkStatus();
}

absl::Status JobsElsewhere::RecordEnd(const UnfinishedJob& job,
                                      const std::string& run_by,
                                      const absl::Status& ended,
                                      const JobResult& result,
                                      bool again) {
  const auto record = [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const StoredMap stored, stores_.OpenToWork(job.map, job.id, run_by));
    StorageWriter& writer = stored.storage->writer();
    return writer.Commit(Durability::kFull, [&]() -> absl::Status {
      const auto change = [&](JobInfo& now, StorageWriter&) -> absl::Status {
        if (!again) {
          EndJob(now, ended, result);
          STRATA_RETURN_IF_ERROR(DropProposalOfEnded(now, writer));
          return writer.DeleteAttempt({WorkKind::kJob, now.id});
        }
        now.state = JobState::kQueued;
        now.parameters.erase(kRunBy);
        return absl::OkStatus();
      };
      return ChangeStoredJob(writer, job.id, change).status();
    });
  };
  while (true) {
    const absl::Status recorded = Guarded(record);
    // Where this server ends it is dead to the others, who take the job.
    if (recorded.ok() || IsLost(recorded) || !Pause()) return absl::OkStatus();
  }
}

}  // namespace strata
