// The one thread behind a map that changes what is derived: integrates scans in commit order, and
// between batches runs what callers and jobs ask for, here or elsewhere. At rest it prepares tiles
// for plans to come.
#ifndef STRATA_CORE_ENGINE_INGEST_WORKER_H_
#define STRATA_CORE_ENGINE_INGEST_WORKER_H_

#include <atomic>
#include <cstdint>
#include <deque>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/ingest/waiting_scans.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/quarantine.h"
#include "core/engine/tiles/tile_keeper.h"
#include "core/storage/records.h"

namespace strata {

// Thread-safe.
class Worker {
 public:
  using Command = absl::FunctionRef<absl::Status(Integrator&)>;
  // Makes all that is derived again; `closing` ends it.
  using Recovery = absl::Status (*)(Integrator&, const Stop& closing);

  // All must outlive the worker. Begins where the last run stopped; `pending` scans wait. `recover`
  // is called first where what is derived is not usable, and again until it succeeds.
  Worker(MapCore& core, Quarantine& quarantine, Recovery recover, std::uint64_t pending);
  ~Worker();

  // RESOURCE_EXHAUSTED while too many scans wait for integration.
  absl::Status CheckRoom() const;
  // One more scan waits. Takes no memory.
  void ScanCommitted(ScanNumber number);
  // Scans may wait that came in elsewhere: they are looked for.
  void ScansWait();
  // Edits up to number `until` wait that were asked for elsewhere: they are carried out before the
  // next batch. Those that come meanwhile wait for the next call, behind a batch.
  void EditsWait(std::uint64_t until);
  // Since when the scan waits that is the first of those that do; as of this process at most.
  absl::Time WaitingSince(ScanNumber oldest);

  // Returns once what is derived is usable: at once, but where it is made again after an update of
  // its format or a repair. `stop` ends the waiting, as in Execute; FAILED_PRECONDITION where
  // making it again is in quarantine, CANCELLED once closed.
  absl::Status AwaitDerived(const Stop& stop);

  // Runs `command` on the worker's thread, before the next batch, and returns its status. `stop`
  // ends the waiting (CANCELLED, DEADLINE_EXCEEDED, naming what is waited for); once begun, a
  // command is waited for. `what`, for those that wait for it: "job 3 (rebuild)". `behind`: edits
  // that wait up to this number go first, others do not.
  absl::Status Execute(const Stop& stop,
                       Command command,
                       absl::string_view what = "an edit",
                       std::uint64_t behind = 0);

  // Whether scans wait, or what is derived has to be made again.
  bool HasWork() const;
  // Nothing waits, is under way or is left to be prepared.
  bool AtRest() const;

  // Ends the thread after the step it is in. What waits is answered `why`. Safe to call again.
  void Close(const absl::Status& why = BeingClosed());

 private:
  struct Task {
    Command command;
    absl::string_view what;
    std::uint64_t behind;
    absl::Status status;
    bool begun = false;
    bool done = false;
  };
  enum class Step { kClosed, kCommand, kEdit, kBatch, kRest };

  void Loop();
  // Calls recover_ if what is derived is not usable; whether it is then.
  bool RunRecovery();
  // Answers all commands with why nothing can be done, until the worker is closed.
  void Refuse();
  Step NextStep() ABSL_LOCKS_EXCLUDED(mutex_);
  bool HasStep() const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  bool EditWaits() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return edits_after_ < edits_until_; }
  bool EditWaitsOrClosed() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return closed_ || EditWaits();
  }
  // Runs one step so that whatever it throws is an error of it alone.
  absl::Status GuardedStep(absl::FunctionRef<absl::Status()> step);
  // What there is time for when nothing else is to be done.
  void RunRest();
  void RunCommand();
  // The next edit that was asked for elsewhere; `refusal`: answers it with that.
  void RunEdit(const absl::Status& refusal = absl::OkStatus());
  // Whether it is answered, or nobody waits for it any more.
  absl::Status Answer(const EditRequest& edit, const absl::Status& refusal);
  void RunBatch();
  absl::StatusOr<int> Integrate();
  // After a batch for which there was no memory.
  void NoteNoMemory();

  MapCore& core_;
  Quarantine& quarantine_;
  const Recovery recover_;
  Integrator integrator_;
  TileKeeper keeper_;
  // The thread's.
  absl::Time next_rest_;
  int no_memory_ = 0;           // batches in a row
  bool after_failure_ = false;  // of a batch
  const Stop closing_;
  std::atomic<bool> derived_usable_ = false;
  mutable absl::Mutex mutex_;
  std::deque<Task*> tasks_ ABSL_GUARDED_BY(mutex_);
  absl::string_view running_ ABSL_GUARDED_BY(mutex_) = "recovery";  // what the thread is at
  std::uint64_t pending_ ABSL_GUARDED_BY(mutex_);
  WaitingScans waiting_ ABSL_GUARDED_BY(mutex_);
  // Edits with numbers in between may wait.
  std::uint64_t edits_after_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t edits_until_ ABSL_GUARDED_BY(mutex_) = 0;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status why_closed_ ABSL_GUARDED_BY(mutex_);
  bool steps_ ABSL_GUARDED_BY(mutex_) = true;  // the thread is at one
  bool refuses_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_WORKER_H_
