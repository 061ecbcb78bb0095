#include "core/engine/job_board.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata {
namespace {

constexpr absl::Duration kReportInterval = absl::Milliseconds(100);
constexpr absl::Duration kStoreInterval = absl::Seconds(2);

absl::Status NoSuchJob(std::uint64_t id) {
  return absl::NotFoundError(absl::StrCat("job ", id, " does not exist"));
}

}  // namespace

// The context of the job that runs now.
class JobBoard::Running final : public JobContext {
 public:
  Running(JobBoard& board, std::uint64_t id, Stop stop, const Stop& closing)
      : board_(board), id_(id), stop_(std::move(stop)), closing_(closing) {}

  absl::Status Progress(double progress, absl::string_view phase) override {
    STRATA_RETURN_IF_ERROR(closing_.status());
    STRATA_RETURN_IF_ERROR(stop_.status());
    const absl::Time now = SteadyNow();
    if (now - reported_ < kReportInterval && phase == phase_) return absl::OkStatus();
    const bool store = now - stored_ >= kStoreInterval;
    reported_ = now;
    phase_ = std::string(phase);
    if (store) stored_ = now;
    board_.Report(id_, progress, phase_, store);
    return absl::OkStatus();
  }
  const Stop& stop() const override { return stop_; }
  void SetMetric(const std::string& name, double value) override { metrics_[name] = value; }
  void SetMessage(std::string message) override { message_ = std::move(message); }
  void SetProposed() override { proposed_ = true; }

  std::map<std::string, double>& metrics() { return metrics_; }
  std::string& message() { return message_; }
  bool proposed() const { return proposed_; }

 private:
  JobBoard& board_;
  const std::uint64_t id_;
  const Stop stop_;
  const Stop& closing_;
  absl::Time reported_ = absl::InfinitePast();
  absl::Time stored_ = SteadyNow();
  std::string phase_;
  std::map<std::string, double> metrics_;
  std::string message_;
  bool proposed_ = false;
};

absl::StatusOr<std::unique_ptr<JobBoard>> JobBoard::Open(MapCore& core) {
  std::vector<JobInfo> stored;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(stored, reader->ListJobs());
  }
  std::unique_ptr<JobBoard> board(new JobBoard(core));
  absl::MutexLock lock(&board->mutex_);
  for (JobInfo& info : stored) {
    if (info.state == JobState::kRunning) info.state = JobState::kQueued;
    board->last_id_ = std::max(board->last_id_, info.id);
    board->jobs_[info.id].info = std::move(info);
  }
  return board;
}

absl::Status JobBoard::Store(const JobInfo& info, Durability durability, const Stop& stop) {
  return core_.writer().Run(
      durability, 0, stop, [&](StorageWriter& writer) { return writer.PutJob(info); });
}

absl::StatusOr<JobInfo> JobBoard::Change(std::uint64_t id,
                                         absl::FunctionRef<void(JobInfo&)> change) {
  absl::MutexLock lock(&mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return NoSuchJob(id);
  change(it->second.info);
  it->second.info.updated = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  ++it->second.changes;
  return it->second.info;
}

absl::StatusOr<JobInfo> JobBoard::Start(const Stop& stop,
                                        absl::string_view kind,
                                        const std::map<std::string, std::string>& parameters) {
  JobInfo info;
  info.kind = std::string(kind);
  info.parameters = parameters;
  info.created = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  info.updated = info.created;
  {
    absl::MutexLock lock(&mutex_);
    info.id = ++last_id_;
  }
  STRATA_RETURN_IF_ERROR(Store(info, Durability::kFull, stop));
  absl::MutexLock lock(&mutex_);
  jobs_[info.id].info = info;
  return info;
}

absl::StatusOr<JobInfo> JobBoard::Get(std::uint64_t id) const {
  absl::MutexLock lock(&mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return NoSuchJob(id);
  return it->second.info;
}

std::vector<JobInfo> JobBoard::List() const {
  std::vector<JobInfo> infos;
  absl::MutexLock lock(&mutex_);
  infos.reserve(jobs_.size());
  for (const auto& [id, entry] : jobs_) infos.push_back(entry.info);
  return infos;
}

absl::StatusOr<JobInfo> JobBoard::Cancel(std::uint64_t id) {
  {
    absl::MutexLock lock(&mutex_);
    const auto it = jobs_.find(id);
    if (it == jobs_.end()) return NoSuchJob(id);
    if (it->second.info.state != JobState::kQueued) {
      it->second.stop.Request();  // nobody hears it if the job has ended
      return it->second.info;
    }
  }
  STRATA_ASSIGN_OR_RETURN(const JobInfo info, Change(id, [](JobInfo& job) {
                            if (job.state == JobState::kQueued) job.state = JobState::kCancelled;
                          }));
  STRATA_RETURN_IF_ERROR(Store(info, Durability::kFull, Stop()));
  return info;
}

void JobBoard::StopRunning() {
  absl::MutexLock lock(&mutex_);
  for (const auto& [id, entry] : jobs_) {
    if (entry.info.state == JobState::kRunning) entry.stop.Request();
  }
}

absl::StatusOr<JobInfo> JobBoard::Decide(std::uint64_t id,
                                         absl::FunctionRef<void(JobInfo&)> change,
                                         WriterThread::Work work) {
  STRATA_ASSIGN_OR_RETURN(JobInfo info, Get(id));
  if (info.state != JobState::kProposed) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", id, " has no proposal that waits; start one with dry_run=1"));
  }
  change(info);
  STRATA_RETURN_IF_ERROR(
      core_.writer().Run(Durability::kFull, 0, Stop(), [&](StorageWriter& writer) -> absl::Status {
        STRATA_RETURN_IF_ERROR(work(writer));
        return writer.PutJob(info);
      }));
  return Change(id, [&](JobInfo& job) { job = info; });
}

absl::StatusOr<JobInfo> JobBoard::Accept(std::uint64_t id) {
  return Decide(
      id,
      [](JobInfo& job) {
        job.state = JobState::kQueued;
        job.parameters.emplace(kAccepted, "1");
      },
      [](StorageWriter&) { return absl::OkStatus(); });
}

absl::StatusOr<JobInfo> JobBoard::Discard(std::uint64_t id) {
  return Decide(
      id,
      [](JobInfo& job) {
        job.state = JobState::kCancelled;
        job.message = std::string("proposal discarded");
      },
      [id](StorageWriter& writer) { return writer.DiscardProposal(id); });
}

absl::Status JobBoard::Watch(const Stop& stop,
                             std::uint64_t id,
                             absl::FunctionRef<absl::Status(const JobInfo&)> sink) const {
  constexpr absl::Duration kPoll = absl::Milliseconds(50);
  std::uint64_t seen = 0;
  absl::Time next = absl::InfinitePast();  // not more often than that
  for (bool first = true;; first = false) {
    JobInfo info;
    {
      absl::MutexLock lock(&mutex_);
      const auto it = jobs_.find(id);
      if (it == jobs_.end()) return NoSuchJob(id);
      const Entry& entry = it->second;
      const auto ended = [&entry] { return IsFinal(entry.info.state); };
      while (SteadyNow() < next && !ended()) {
        STRATA_RETURN_IF_ERROR(stop.status());
        mutex_.AwaitWithTimeout(absl::Condition(&ended), std::min(kPoll, next - SteadyNow()));
      }
      const auto changed = [&entry, &seen, first] { return first || entry.changes != seen; };
      while (!mutex_.AwaitWithTimeout(absl::Condition(&changed), kPoll)) {
        STRATA_RETURN_IF_ERROR(stop.status());
      }
      seen = entry.changes;
      info = entry.info;
    }
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_RETURN_IF_ERROR(sink(info));
    next = SteadyNow() + kReportInterval;
    if (IsFinal(info.state)) return absl::OkStatus();
  }
}

bool JobBoard::AnyIn(JobState state) const {
  absl::MutexLock lock(&mutex_);
  return std::any_of(jobs_.begin(), jobs_.end(), [state](const auto& entry) {
    return entry.second.info.state == state;
  });
}

void JobBoard::Report(std::uint64_t id, double progress, const std::string& phase, bool durable) {
  const absl::StatusOr<JobInfo> info = Change(id, [&](JobInfo& job) {
    job.progress = progress;
    job.phase = phase;
  });
  // Progress is for people; losing it is no reason to end the job.
  if (durable && info.ok()) Store(*info, Durability::kRelaxed, Stop()).IgnoreError();
}

absl::StatusOr<std::optional<JobInfo>> JobBoard::TakeNext(Stop& stop) {
  JobInfo taken;
  {
    absl::MutexLock lock(&mutex_);
    const auto it = std::find_if(jobs_.begin(), jobs_.end(), [](const auto& entry) {
      return entry.second.info.state == JobState::kQueued;
    });
    if (it == jobs_.end()) return std::optional<JobInfo>();
    it->second.info.state = JobState::kRunning;
    it->second.info.updated = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
    ++it->second.changes;
    stop = it->second.stop;
    taken = it->second.info;
  }
  if (const absl::Status stored = Store(taken, Durability::kRelaxed, Stop()); !stored.ok()) {
    STRATA_RETURN_IF_ERROR(Requeue(taken.id));
    return stored;
  }
  return std::optional<JobInfo>(std::move(taken));
}

absl::Status JobBoard::Requeue(std::uint64_t id) {
  return Change(id, [](JobInfo& job) { job.state = JobState::kQueued; }).status();
}

absl::Status JobBoard::Finish(std::uint64_t id, const absl::Status& ended, Running& context) {
  JobInfo info;
  STRATA_ASSIGN_OR_RETURN(info, Get(id));
  for (const auto& [name, value] : context.metrics()) info.metrics[name] = value;
  info.phase.clear();
  if (ended.ok()) {
    info.state = context.proposed() ? JobState::kProposed : JobState::kSucceeded;
    info.progress = 1.0;
    info.message = context.message();
  } else {
    info.state = absl::IsCancelled(ended) ? JobState::kCancelled : JobState::kFailed;
    info.message = std::string(ended.message());
  }
  info.updated = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  // Durable before anybody sees that it ended; if that cannot be, it did not.
  if (absl::Status stored = Store(info, Durability::kFull, Stop()); !stored.ok()) {
    STRATA_RETURN_IF_ERROR(Requeue(id));
    return stored;
  }
  return Change(id, [&](JobInfo& job) { job = info; }).status();
}

absl::Status JobBoard::RunNext(const Stop& closing,
                               absl::FunctionRef<absl::Status(const JobInfo&, JobContext&)> body) {
  Stop stop;
  STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job, TakeNext(stop));
  if (!job.has_value()) return absl::OkStatus();
  Running context(*this, job->id, stop, closing);
  const absl::Status ended = body(*job, context);
  if (closing.requested() && !ended.ok()) return Requeue(job->id);
  return Finish(job->id, ended, context);
}

}  // namespace strata
