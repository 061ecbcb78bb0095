#include "core/engine/jobs/job_board.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/jobs/job_handlers.h"

namespace strata {
namespace {

constexpr absl::Duration kReportInterval = absl::Milliseconds(100);
constexpr absl::Duration kStoreInterval = absl::Seconds(2);

// Another engine may have queued a job meanwhile.
absl::Status TakeFreeId(StorageReader& reader, JobInfo& job) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> taken, reader.FindJob(job.id));
    if (!taken.has_value()) return absl::OkStatus();
    ++job.id;
  }
}

// Whether other engines may have made the stored state of the shown one.
bool DecidedElsewhere(const JobInfo& shown, const JobInfo& stored) {
  const bool queued = stored.state == JobState::kQueued;
  if (shown.state == JobState::kQueued) {
    return IsFinal(stored.state) || (queued && IsAccepted(stored) != IsAccepted(shown));
  }
  return shown.state == JobState::kProposed && (queued || stored.state == JobState::kCancelled);
}

// Of the engine before, which ran them: here nobody does.
absl::Status LeaveToWorkers(MapCore& core, const std::vector<JobInfo>& jobs) {
  return core.writer().Run(
      Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) -> absl::Status {
        for (const JobInfo& job : jobs) {
          const bool left = job.state == JobState::kRunning && !RunsElsewhere(job);
          if (!left || !RunsAnywhere(job)) continue;
          JobInfo queued = job;
          queued.state = JobState::kQueued;
          STRATA_RETURN_IF_ERROR(writer.PutJob(queued));
        }
        return absl::OkStatus();
      });
}

// That another engine runs a job of the map: one at a time.
absl::Status CheckNoneElsewhere(StorageReader& reader) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, reader.ListJobs());
  if (std::none_of(jobs.begin(), jobs.end(), &RunsElsewhere)) return absl::OkStatus();
  return absl::AbortedError("another server runs a job of the map");
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
  void SetMetric(const std::string& name, double value) override { result_.metrics[name] = value; }
  void SetMessage(std::string message) override { result_.message = std::move(message); }
  void SetProposed() override { result_.proposed = true; }
  void SetAccepted() override { result_.accepted = true; }

  const JobResult& result() const { return result_; }

 private:
  JobBoard& board_;
  const std::uint64_t id_;
  const Stop stop_;
  const Stop& closing_;
  absl::Time reported_ = absl::InfinitePast();
  absl::Time stored_ = SteadyNow();
  std::string phase_;
  JobResult result_;
};

// A job that is about to be queued: counted among those that wait.
class JobBoard::StartTurn {
 public:
  // `id`: of the job.
  StartTurn(JobBoard& board, absl::string_view owner, std::uint64_t& id)
      : board_(board), owner_(owner) {
    absl::MutexLock lock(&board_.mutex_);
    status_ = board_.CheckRoom(owner);
    if (!status_.ok()) return;
    board_.starting_.insert(owner_);
    id = ++board_.last_id_;
  }
  ~StartTurn() {
    if (!status_.ok()) return;
    absl::MutexLock lock(&board_.mutex_);
    board_.starting_.erase(board_.starting_.find(owner_));
  }
  StartTurn(const StartTurn&) = delete;
  StartTurn& operator=(const StartTurn&) = delete;
  const absl::Status& status() const { return status_; }

 private:
  JobBoard& board_;
  const std::string owner_;
  absl::Status status_;
};

absl::StatusOr<std::unique_ptr<JobBoard>> JobBoard::Open(MapCore& core, Quarantine& quarantine) {
  std::vector<JobInfo> stored;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(stored, reader->ListJobs());
  }
  if (!core.options().works) STRATA_RETURN_IF_ERROR(LeaveToWorkers(core, stored));
  std::unique_ptr<JobBoard> board(new JobBoard(core, quarantine));
  absl::MutexLock lock(&board->mutex_);
  for (JobInfo& info : stored) {
    if (info.state == JobState::kRunning && !RunsElsewhere(info)) info.state = JobState::kQueued;
    board->last_id_ = std::max(board->last_id_, info.id);
    auto entry = std::make_shared<Entry>();
    entry->info = std::move(info);
    board->jobs_[entry->info.id] = std::move(entry);
  }
  return board;
}

void JobBoard::Show(const JobInfo& info) {
  JobInfo shown = info;
  auto made =
      std::make_shared<Entry>();  // without memory there is no entry, rather than half of one
  absl::MutexLock lock(&mutex_);
  std::shared_ptr<Entry>& entry = jobs_.try_emplace(info.id, std::move(made)).first->second;
  entry->info = std::move(shown);
  ++entry->changes;
}

absl::StatusOr<JobInfo> JobBoard::Change(std::uint64_t id,
                                         Durability durability,
                                         ChangeFunction change) {
  JobInfo info;
  STRATA_RETURN_IF_ERROR(core_.writer().Run(
      durability,
      0,
      Stop(),
      [&](StorageWriter& writer) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(info, ChangeStoredJob(writer, id, change));
        return absl::OkStatus();
      },
      [&] { Show(info); }));
  return info;
}

absl::Status JobBoard::CheckRoom(absl::string_view owner) const {
  std::size_t all = starting_.size();
  std::size_t own = starting_.count(std::string(owner));
  for (const auto& [id, entry] : jobs_) {
    if (entry->info.state != JobState::kQueued) continue;
    ++all;
    own += entry->owner == owner ? 1 : 0;
  }
  if (all >= kMaxWaitingJobs || own >= kMaxWaitingJobsOfOne) {
    return absl::ResourceExhaustedError(absl::StrCat(all,
                                                     " jobs wait, ",
                                                     own,
                                                     " of them yours; at most ",
                                                     kMaxWaitingJobs,
                                                     " and ",
                                                     kMaxWaitingJobsOfOne,
                                                     "; wait for some, or cancel them"));
  }
  return absl::OkStatus();
}

std::vector<std::uint64_t> JobBoard::Outdated() const {
  const auto epoch = static_cast<double>(core_.snapshots().current().epoch);
  std::vector<std::uint64_t> ended;
  std::set<std::string> last;  // kinds whose newest success has been seen
  absl::MutexLock lock(&mutex_);
  std::size_t kept = 0;
  for (auto it = jobs_.rbegin(); it != jobs_.rend(); ++it) {
    const JobInfo& job = it->second->info;
    if (!IsFinal(job.state) || job.state == JobState::kProposed) continue;
    if (kept < kKeptJobs) {
      ++kept;
      if (job.state == JobState::kSucceeded) last.insert(job.kind);
      continue;
    }
    const auto made = job.metrics.find("epoch");
    if (made != job.metrics.end() && made->second == epoch) continue;
    if (job.state == JobState::kSucceeded && last.insert(job.kind).second) continue;
    ended.push_back(job.id);
  }
  return ended;
}

absl::StatusOr<JobInfo> JobBoard::Start(const Stop& stop,
                                        absl::string_view owner,
                                        absl::string_view kind,
                                        const std::map<std::string, std::string>& parameters) {
  JobInfo info;
  info.kind = std::string(kind);
  info.parameters = parameters;
  info.created = NowInMicros();
  info.updated = info.created;
  const StartTurn turn(*this, owner, info.id);
  STRATA_RETURN_IF_ERROR(turn.status());
  const std::vector<std::uint64_t> outdated = Outdated();
  const auto show = [&] {
    Show(info);
    absl::MutexLock lock(&mutex_);
    last_id_ = std::max(last_id_, info.id);
    jobs_.at(info.id)->owner = std::string(owner);
    for (const std::uint64_t id : outdated) jobs_.erase(id);
  };
  STRATA_RETURN_IF_ERROR(core_.writer().Run(
      Durability::kFull,
      0,
      stop,
      [&](StorageWriter& writer) -> absl::Status {
        for (const std::uint64_t id : outdated) STRATA_RETURN_IF_ERROR(writer.DeleteJob(id));
        STRATA_RETURN_IF_ERROR(TakeFreeId(writer.reader(), info));
        return writer.PutJob(info);
      },
      show));
  return info;
}

JobBoard::AllShown JobBoard::WhatIsShown(std::optional<std::uint64_t> id) const {
  AllShown shown;
  absl::MutexLock lock(&mutex_);
  const auto first = id.has_value() ? jobs_.find(*id) : jobs_.begin();
  const auto last = id.has_value() && first != jobs_.end() ? std::next(first) : jobs_.end();
  for (auto it = first; it != last; ++it) {
    const Entry& entry = *it->second;
    shown[it->first] = {entry.changes, entry.info.state, entry.stop};
  }
  return shown;
}

absl::StatusOr<bool> JobBoard::TakeIn(std::optional<std::uint64_t> id) {
  const AllShown before = WhatIsShown(id);
  std::vector<JobInfo> stored;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    if (id.has_value()) {
      STRATA_ASSIGN_OR_RETURN(std::optional<JobInfo> job, reader->FindJob(*id));
      if (job.has_value()) stored.push_back(*std::move(job));
    } else {
      STRATA_ASSIGN_OR_RETURN(stored, reader->ListJobs());
    }
  }
  absl::MutexLock lock(&mutex_);
  for (JobInfo& info : stored) TakeInOne(std::move(info), before);
  return NextIdLocked().has_value();
}

// What was changed here since the store was read is newer than what was read, or will be seen at
// the next look.
void JobBoard::TakeInOne(JobInfo&& stored, const AllShown& before) {
  const auto shown = before.find(stored.id);
  const auto it = jobs_.find(stored.id);
  if (shown == before.end() && it == jobs_.end()) {
    last_id_ = std::max(last_id_, stored.id);
    auto entry = std::make_shared<Entry>();
    entry->info = std::move(stored);
    jobs_[entry->info.id] = std::move(entry);
    return;
  }
  if (shown == before.end() || it == jobs_.end()) return;
  // The run that was under way before: no later one is meant.
  if (shown->second.state == JobState::kRunning && IsToldToEnd(stored)) {
    shown->second.stop.Request();
  }
  Entry& entry = *it->second;
  if (entry.changes != shown->second.changes) return;
  const bool ran_elsewhere = RunsElsewhere(entry.info) || RunsElsewhere(stored);
  const bool news = stored.state != entry.info.state || stored.updated != entry.info.updated;
  if (!(ran_elsewhere && news) && !DecidedElsewhere(entry.info, stored)) return;
  entry.info = std::move(stored);
  ++entry.changes;
}

absl::StatusOr<JobInfo> JobBoard::Get(std::uint64_t id) const {
  absl::MutexLock lock(&mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return NoSuchJob(id);
  return it->second->info;
}

std::vector<JobInfo> JobBoard::List() const {
  std::vector<JobInfo> infos;
  absl::MutexLock lock(&mutex_);
  infos.reserve(jobs_.size());
  for (const auto& [id, entry] : jobs_) infos.push_back(entry->info);
  return infos;
}

absl::StatusOr<JobInfo> JobBoard::Cancel(std::uint64_t id) {
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      const auto it = jobs_.find(id);
      if (it == jobs_.end()) return NoSuchJob(id);
      const Entry& entry = *it->second;
      if (IsFinal(entry.info.state)) return entry.info;
      if (entry.info.state == JobState::kRunning)
        entry.stop.Request();  // a commit may have to wait
    }
    std::optional<Stop> run;
    absl::StatusOr<JobInfo> cancelled =
        Change(id, Durability::kFull, [&](JobInfo& job, StorageWriter& writer) -> absl::Status {
          if (IsFinal(job.state)) return absl::AbortedError("the job has ended");
          const bool elsewhere = RunsElsewhere(job);
          run = elsewhere ? std::nullopt : StopOfRun(job);
          if (elsewhere || run.has_value()) {
            TellToEnd(job);
          } else {
            job.state = JobState::kCancelled;
            ForgetToldToEnd(job);
          }
          return DropProposalOfEnded(job, writer);
        });
    if (!absl::IsAborted(cancelled.status())) {
      if (run.has_value()) run->Request();
      return cancelled;
    }
    // It ended meanwhile, or another engine cancelled it, and will be seen so.
    STRATA_RETURN_IF_ERROR(TakeIn(id).status());
  }
}

// A job that was running when the last process ended is stored so, and waits; one that has begun in
// this one was shown so before this commit began.
std::optional<Stop> JobBoard::StopOfRun(JobInfo& job) const {
  absl::MutexLock lock(&mutex_);
  const auto it = jobs_.find(job.id);
  if (it == jobs_.end() || it->second->info.state != JobState::kRunning) return std::nullopt;
  job.progress = it->second->info.progress;
  job.phase = it->second->info.phase;
  return it->second->stop;
}

void JobBoard::StopRunning() {
  absl::MutexLock lock(&mutex_);
  for (const auto& [id, entry] : jobs_) {
    if (entry->info.state == JobState::kRunning) entry->stop.Request();
  }
}

absl::StatusOr<JobInfo> JobBoard::Accept(std::uint64_t id) {
  return Change(id, Durability::kFull, &AcceptProposal);
}

absl::StatusOr<JobInfo> JobBoard::Discard(std::uint64_t id) {
  return Change(id, Durability::kFull, &DiscardProposal);
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
      const std::shared_ptr<const Entry> held = it->second;
      const Entry& entry = *held;
      const auto ended = [&entry] { return IsFinal(entry.info.state); };
      while (SteadyNow() < next && !ended()) {
        STRATA_RETURN_IF_ERROR(stop.status());
        STRATA_RETURN_IF_ERROR(core_.closed());
        mutex_.AwaitWithTimeout(absl::Condition(&ended), std::min(kPoll, next - SteadyNow()));
      }
      const auto changed = [&entry, &seen, first] { return first || entry.changes != seen; };
      while (!mutex_.AwaitWithTimeout(absl::Condition(&changed), kPoll)) {
        STRATA_RETURN_IF_ERROR(stop.status());
        STRATA_RETURN_IF_ERROR(core_.closed());
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
    return entry.second->info.state == state;
  });
}

bool JobBoard::AnyElsewhere() const {
  absl::MutexLock lock(&mutex_);
  return std::any_of(jobs_.begin(), jobs_.end(), [](const auto& entry) {
    return RunsElsewhere(entry.second->info);
  });
}

absl::Status JobBoard::ReturnDead(const std::set<std::string>& alive) {
  std::map<std::uint64_t, std::string> dead;  // run_by, by id
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [id, entry] : jobs_) {
      if (!RunsElsewhere(entry->info)) continue;
      std::string run_by = RunBy(entry->info);
      if (!alive.contains(HolderOf(run_by))) dead.emplace(id, std::move(run_by));
    }
  }
  for (const auto& [id, holder] : dead) {
    const std::string& run_by = holder;  // clang 14 lets no lambda have a binding
    const absl::Status returned =
        Change(id, Durability::kFull, [&](JobInfo& job, StorageWriter& writer) {
          if (RunsElsewhere(job) && RunBy(job) == run_by) return ReturnDeadJob(job, writer);
          return absl::AbortedError("it has ended, or is run by another");
        }).status();
    if (!absl::IsAborted(returned)) STRATA_RETURN_IF_ERROR(returned);
  }
  return absl::OkStatus();
}

bool JobBoard::LastIsQuarantined(absl::string_view kind) const {
  absl::MutexLock lock(&mutex_);
  const auto last = std::find_if(jobs_.rbegin(), jobs_.rend(), [kind](const auto& entry) {
    return entry.second->info.kind == kind;
  });
  return last != jobs_.rend() && IsQuarantined(last->second->info);
}

std::optional<std::uint64_t> JobBoard::NextId() const {
  absl::MutexLock lock(&mutex_);
  return NextIdLocked();
}

std::optional<std::uint64_t> JobBoard::NextIdLocked() const {
  std::optional<std::pair<std::uint64_t, std::uint64_t>> next;  // last turn of its owner, id
  const bool works = core_.options().works;
  for (const auto& [id, entry] : jobs_) {
    if (RunsElsewhere(entry->info)) return std::nullopt;
    if (entry->info.state != JobState::kQueued) continue;
    if (!works && RunsAnywhere(entry->info)) continue;
    const auto turn = turns_.find(entry->owner);
    const std::pair mine(turn == turns_.end() ? 0 : turn->second, id);
    if (!next.has_value() || mine < *next) next = mine;
  }
  if (!next.has_value()) return std::nullopt;
  return next->second;
}

void JobBoard::Report(std::uint64_t id, double progress, const std::string& phase, bool durable) {
  const auto report = [&](JobInfo& job) {
    job.progress = progress;
    job.phase = phase;
    job.updated = NowInMicros();
  };
  {
    absl::MutexLock lock(&mutex_);
    Entry& entry = *jobs_.at(id);
    report(entry.info);
    ++entry.changes;
  }
  if (!durable) return;
  // Progress is for people; losing it is no reason to end the job.
  Change(id, Durability::kRelaxed, [&](JobInfo& job, StorageWriter&) {
    report(job);
    return absl::OkStatus();
  }).IgnoreError();
}

absl::StatusOr<std::optional<JobInfo>> JobBoard::TakeNext(Stop& stop) {
  while (true) {
    std::uint64_t id = 0;
    {
      absl::MutexLock lock(&mutex_);
      const std::optional<std::uint64_t> next = NextIdLocked();
      if (!next.has_value()) return std::optional<JobInfo>();
      id = *next;
      Entry& entry = *jobs_.at(id);
      entry.stop = Stop();  // an earlier run may have been asked to end
      stop = entry.stop;
      turns_[entry.owner] = ++turn_;
    }
    const WorkId work{WorkKind::kJob, id};
    bool told_to_end = false;
    absl::StatusOr<JobInfo> taken =
        Change(id, Durability::kRelaxed, [&](JobInfo& job, StorageWriter& writer) -> absl::Status {
          if (IsFinal(job.state)) return absl::AbortedError("the job has ended");
          if (!core_.options().store.empty()) {
            STRATA_RETURN_IF_ERROR(CheckNoneElsewhere(writer.reader()));
          }
          told_to_end = IsToldToEnd(job);
          job.state = JobState::kRunning;
          return quarantine_.Begin(writer, work);
        });
    if (absl::IsAborted(taken.status())) {  // it was cancelled, maybe by another engine
      STRATA_RETURN_IF_ERROR(TakeIn().status());
      continue;
    }
    STRATA_RETURN_IF_ERROR(taken.status());
    // In an earlier run, of which its runner knows how far it came.
    if (told_to_end) stop.Request();
    return std::optional<JobInfo>(*std::move(taken));
  }
}

absl::Status JobBoard::Requeue(std::uint64_t id) {
  const WorkId work{WorkKind::kJob, id};
  const absl::Status stored = Guarded([&] {
    return Change(id,
                  Durability::kRelaxed,
                  [&](JobInfo& job, StorageWriter& writer) {
                    job.state = JobState::kQueued;
                    return quarantine_.Pause(writer, work);
                  })
        .status();
  });
  if (stored.ok()) return stored;
  absl::MutexLock lock(&mutex_);
  Entry& entry = *jobs_.at(id);
  entry.info.state = JobState::kQueued;
  ++entry.changes;
  return absl::OkStatus();
}

absl::Status JobBoard::Finish(std::uint64_t id, const absl::Status& ended, Running& context) {
  const WorkId work{WorkKind::kJob, id};
  // Durable before anybody sees that it ended.
  return Change(id,
                Durability::kFull,
                [&](JobInfo& job, StorageWriter& writer) -> absl::Status {
                  EndJob(job, ended, context.result());
                  STRATA_RETURN_IF_ERROR(DropProposalOfEnded(job, writer));
                  return quarantine_.End(writer, work);
                })
      .status();
}

absl::Status JobBoard::RunNext(const Stop& closing,
                               absl::FunctionRef<absl::Status(const JobInfo&, JobContext&)> body) {
  Stop stop;
  STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job, TakeNext(stop));
  if (!job.has_value()) return absl::OkStatus();
  if (closing.requested()) stop.Request();  // whoever closes may have looked before it ran
  Running context(*this, job->id, stop, closing);
  absl::Status ended = Guarded([&] { return body(*job, context); });
  if (closing.requested() && !ended.ok()) return Requeue(job->id);
  // The store was away, which is no fault of the job; its runner tries again in a while.
  if (absl::IsUnavailable(ended)) {
    if (stop.requested()) {
      ended = absl::CancelledError(ended.message());
    } else {
      STRATA_RETURN_IF_ERROR(Requeue(job->id));
      return ended;
    }
  }
  absl::Status stored = Guarded([&] { return Finish(job->id, ended, context); });
  // If that cannot be, it did not end.
  if (!stored.ok()) STRATA_RETURN_IF_ERROR(Requeue(job->id));
  return stored;
}

}  // namespace strata
