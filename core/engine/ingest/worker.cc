#include "core/engine/ingest/worker.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"
#include "core/engine/ingest/edits.h"
#include "core/engine/map/engine_options.h"

namespace strata {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(50);
// After which a sender may ask whether there is room again: some scans are integrated by then.
constexpr absl::Duration kQueueDelay = absl::Milliseconds(200);
// Transactions of scans, as long as nothing else is to be done: each is written while the next one
// is filled.
constexpr int kBatchesInARow = 4;
// So often a scan is tried again alone when there was no memory.
constexpr int kMemoryTries = 10;
// So often an edit is begun whose owner came to no end: it may have died of it.
constexpr std::uint32_t kMostBegun = 5;

// What there is no memory to log is not logged.
void LogStopped(absl::string_view event, absl::string_view map, const absl::Status& why) {
  Guarded([&] {
    LOG(ERROR) << LogLine(event).Add("map", map).Add("stopped", why.message());
    return absl::OkStatus();
  }).IgnoreError();
}

absl::Status Refusal() {
  return absl::FailedPreconditionError(
      "quarantined: the server died while it made the map's tiles again after a start; stratad "
      "quarantine release has it try once more");
}

// Whether the derived tables are marked incomplete: they were dropped, or written by a program with
// another format.
absl::StatusOr<bool> NeedsRecovery(MapCore& core) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  return !clock.derived_complete;
}

absl::StatusOr<std::optional<EditRequest>> FindEdit(MapCore& core,
                                                    std::uint64_t after,
                                                    std::uint64_t until) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return reader->FindEdit(after, until);
}

}  // namespace

Worker::Worker(MapCore& core, Quarantine& quarantine, Recovery recover, std::uint64_t pending)
    : core_(core),
      quarantine_(quarantine),
      recover_(recover),
      integrator_(core),
      keeper_(core, quarantine),
      next_rest_(SteadyNow() + core.options().prepare_after),
      pending_(pending),
      waiting_(SteadyNow()),
      thread_([this] { Loop(); }) {}

Worker::~Worker() { Close(); }

absl::Status Worker::CheckRoom() const {
  absl::MutexLock lock(&mutex_);
  const std::uint64_t most = core_.options().max_pending_scans;
  if (pending_ < most) return absl::OkStatus();
  return WithRetryDelay(
      absl::ResourceExhaustedError(
          absl::StrCat(pending_, " scans wait for integration, at most ", most, "; retry later")),
      kQueueDelay);
}

void Worker::ScanCommitted(ScanNumber number) {
  absl::MutexLock lock(&mutex_);
  ++pending_;
  waiting_.Add(number, SteadyNow());
}

// Where some are known to wait, all are found that there are.
void Worker::ScansWait() {
  absl::MutexLock lock(&mutex_);
  if (pending_ > 0) return;
  pending_ = 1;
  waiting_.Add(ScanNumber{1}, SteadyNow());  // which no other is below
}

// Those that came since the last look wait for the next one: batches have their turn, too.
void Worker::EditsWait(std::uint64_t until) {
  absl::MutexLock lock(&mutex_);
  if (EditWaits()) return;
  edits_after_ = 0;
  edits_until_ = until;
}

absl::Time Worker::WaitingSince(ScanNumber oldest) {
  absl::MutexLock lock(&mutex_);
  return waiting_.Since(oldest);
}

absl::Status Worker::Execute(const Stop& stop,
                             Command command,
                             absl::string_view what,
                             std::uint64_t behind) {
  Task task{command, what, behind, absl::OkStatus()};
  const BlockingScope blocking;  // for as long as the pass under way takes
  absl::MutexLock lock(&mutex_);
  if (closed_) return why_closed_;
  if (refuses_) return Refusal();
  if (behind > 0) {
    if (!EditWaits()) edits_after_ = 0;
    edits_until_ = std::max(edits_until_, behind);
  }
  tasks_.push_back(&task);
  while (!mutex_.AwaitWithTimeout(absl::Condition(&task.done), kStopPoll)) {
    // The task must leave the queue before this frame is left, in whatever way.
    absl::Status waiting = Guarded([&stop] { return stop.status(); });
    if (waiting.ok() || task.begun) continue;
    tasks_.erase(std::find(tasks_.begin(), tasks_.end(), &task));
    return Annotate(waiting, absl::StrCat("waited for ", running_, " of map ", core_.name()));
  }
  return task.status;
}

absl::Status Worker::AwaitDerived(const Stop& stop) {
  if (derived_usable_) return absl::OkStatus();
  const BlockingScope blocking(/*in_turn=*/true);
  absl::MutexLock lock(&mutex_);
  const auto ended = [this]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return derived_usable_ || refuses_ || closed_;
  };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&ended), kStopPoll)) {
    const absl::Status waiting = stop.status();
    if (waiting.ok()) continue;
    return Annotate(waiting,
                    absl::StrCat("waited for the tiles of map ", core_.name(), ", made again"));
  }
  if (derived_usable_) return absl::OkStatus();
  return refuses_ ? Refusal() : why_closed_;
}

bool Worker::HasStep() const { return closed_ || !tasks_.empty() || EditWaits() || pending_ > 0; }

bool Worker::HasWork() const {
  absl::MutexLock lock(&mutex_);
  return pending_ > 0 || EditWaits() || !(derived_usable_ || refuses_);
}

bool Worker::AtRest() const {
  absl::MutexLock lock(&mutex_);
  return refuses_ ||
         (pending_ == 0 && tasks_.empty() && !EditWaits() && !steps_ && keeper_.AtRest());
}

// Commands and edits go first, since somebody waits for them, in the order in which they were asked
// for: whoever goes on asking elsewhere keeps nobody from his turn.
Worker::Step Worker::NextStep() {
  absl::MutexLock lock(&mutex_);
  steps_ = false;
  while (
      !mutex_.AwaitWithTimeout(absl::Condition(this, &Worker::HasStep), next_rest_ - SteadyNow())) {
    // A clock that is set forward ends a wait early.
    if (SteadyNow() < next_rest_) continue;
    steps_ = true;
    return Step::kRest;
  }
  steps_ = true;
  if (closed_) return Step::kClosed;
  if (EditWaits() && (tasks_.empty() || tasks_.front()->behind > edits_after_)) return Step::kEdit;
  return tasks_.empty() ? Step::kBatch : Step::kCommand;
}

void Worker::Loop() {
  NameThisThread("worker");
  YieldThisThread(5);  // what is acknowledged waits for nobody
  if (!RunRecovery()) return Refuse();
  while (true) {
    const Step step = NextStep();
    if (step != Step::kRest) keeper_.Pause();
    switch (step) {
      case Step::kClosed:
        return quarantine_.EndScans();
      case Step::kRest:
        RunRest();
        break;
      case Step::kCommand:
        RunCommand();
        break;
      case Step::kEdit:
        RunEdit();
        break;
      case Step::kBatch:
        // What there is no memory to say of it is not said.
        Guarded([this] {
          RunBatch();
          return absl::OkStatus();
        }).IgnoreError();
        break;
    }
  }
}

absl::Status Worker::GuardedStep(absl::FunctionRef<absl::Status()> step) {
  absl::Status done = Guarded(step);
  // Left in the middle of anything, its caches may be neither before nor after it.
  if (absl::IsResourceExhausted(done)) integrator_.ForgetCaches();
  return done;
}

void Worker::RunRest() {
  {
    absl::MutexLock lock(&mutex_);
    running_ = "the tile that is prepared";
  }
  next_rest_ = SteadyNow() + keeper_.Step();
}

void Worker::RunCommand() {
  Task* task = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    if (tasks_.empty()) return;  // its caller gave up
    task = tasks_.front();
    tasks_.pop_front();
    task->begun = true;
    running_ = task->what;
  }
  const absl::Status status = GuardedStep([&] { return task->command(integrator_); });
  absl::MutexLock lock(&mutex_);
  running_ = "the next step";  // the task's own words go with its caller
  task->status = status;
  task->done = true;
}

void Worker::RunEdit(const absl::Status& refusal) {
  std::uint64_t after = 0, until = 0;
  {
    absl::MutexLock lock(&mutex_);
    after = edits_after_;
    until = edits_until_;
    running_ = "an edit that was asked for at another server";
  }
  const absl::Status done = Guarded([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::optional<EditRequest> edit, FindEdit(core_, after, until));
    after = edit.has_value() ? edit->number : until;
    return edit.has_value() ? Answer(*edit, refusal) : absl::OkStatus();
  });
  // What is not answered is found by the next look.
  if (!done.ok()) LogStopped("edits", core_.name(), done);
  absl::MutexLock lock(&mutex_);
  edits_after_ = done.ok() ? after : until;
  running_ = "the next step";
}

// The answer is part of the commit that carries it out, so that it is carried out once: also where
// this engine ends meanwhile, and the next one finds it.
absl::Status Worker::Answer(const EditRequest& edit, const absl::Status& refusal) {
  absl::Status done = refusal;
  if (done.ok() && edit.begun >= kMostBegun) {
    done = absl::AbortedError(absl::StrCat(
        "it was begun ", edit.begun, " times, and no server came to its end; nothing has changed"));
  }
  if (done.ok()) {
    STRATA_RETURN_IF_ERROR(
        core_.writer().Run(Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) {
          return writer.BeginEdit(edit.number);
        }));
    const auto answer = [&](StorageWriter& writer) {
      return writer.AnswerEdit(edit.number, absl::OkStatus());
    };
    done = GuardedStep([&] { return CarryOut(edit, integrator_, Stop(), answer); });
  }
  // What became of it is to be seen in the store, by whoever opens the map next.
  if (done.ok() || !core_.doubt().ok()) return done;
  const absl::Status told =
      core_.writer().Run(Durability::kFull, 0, Stop(), [&](StorageWriter& writer) {
        return writer.AnswerEdit(edit.number, done);
      });
  return absl::IsAborted(told) ? absl::OkStatus() : told;  // it was withdrawn
}

void Worker::RunBatch() {
  std::uint64_t waited = 0;
  {
    absl::MutexLock lock(&mutex_);
    waited = pending_;
    running_ = "integration";
  }
  int count = 0;
  const absl::Status done = GuardedStep([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(count, Integrate());
    return absl::OkStatus();
  });
  if (!done.ok()) quarantine_.EndScans();
  after_failure_ = !done.ok();
  if (IsOutOfMemory(done)) return NoteNoMemory();
  no_memory_ = 0;
  absl::MutexLock lock(&mutex_);
  if (done.ok()) {
    // Scans that were deleted while they waited are counted, but are not there any more.
    pending_ -= count == 0 ? waited : std::min(pending_, static_cast<std::uint64_t>(count));
    if (pending_ == 0) waiting_.Clear();
    return;
  }
  LogStopped("integration", core_.name(), done);
  mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay);
}

absl::StatusOr<int> Worker::Integrate() {
  // What memory or the disk has no room for all at once, it may have room for one by one.
  const int most = after_failure_ ? 1 : kBatchesInARow * core_.options().max_batch_scans;
  STRATA_ASSIGN_OR_RETURN(const int begun, quarantine_.BeginScans(most));
  if (begun == 0) return 0;
  return integrator_.IntegratePending(begun, [this] {
    absl::MutexLock lock(&mutex_);
    return !closed_ && tasks_.empty() && !EditWaits();
  });
}

// Somebody else may have the memory just now; a scan that never gets enough of it holds up those
// behind it.
void Worker::NoteNoMemory() {
  if (++no_memory_ > kMemoryTries) {
    const absl::Status held = GuardedStep(
        [this] { return quarantine_.HoldNextScan("there is no memory to integrate it"); });
    if (held.ok()) no_memory_ = 0;
  }
  absl::MutexLock lock(&mutex_);
  mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay);
}

bool Worker::RunRecovery() {
  const WorkId recovery{WorkKind::kRecovery, 0};
  if (quarantine_.IsHeld(recovery)) return false;
  while (true) {
    const absl::Status done = GuardedStep([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const bool needed, NeedsRecovery(core_));
      if (!needed) return absl::OkStatus();
      LOG(WARNING) << LogLine("recovery").Add("map", core_.name()).Add("made_again", "tiles");
      STRATA_RETURN_IF_ERROR(quarantine_.Begin(recovery));
      const absl::Status recovered = Guarded([&] { return recover_(integrator_, closing_); });
      quarantine_.End(recovery).IgnoreError();
      return recovered;
    });
    if (done.ok()) derived_usable_ = true;
    if (done.ok() || closing_.requested()) return true;
    LogStopped("recovery", core_.name(), done);
    absl::MutexLock lock(&mutex_);
    if (mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay)) return true;
  }
}

void Worker::Refuse() {
  LogStopped("recovery", core_.name(), Refusal());
  {
    absl::MutexLock lock(&mutex_);
    refuses_ = true;
    for (Task* task : tasks_) {
      task->status = Refusal();
      task->done = true;
    }
    tasks_.clear();
  }
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      mutex_.Await(absl::Condition(this, &Worker::EditWaitsOrClosed));
      if (closed_) return;
    }
    RunEdit(Refusal());
  }
}

void Worker::Close(const absl::Status& why) {
  {
    absl::MutexLock lock(&mutex_);
    if (!closed_) why_closed_ = why;
    closed_ = true;
    for (Task* task : tasks_) {
      task->status = why;
      task->done = true;
    }
    tasks_.clear();
  }
  closing_.Request();
  if (thread_.joinable()) thread_.join();
}

}  // namespace strata
