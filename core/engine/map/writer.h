// The one thread that writes a map: acknowledgements first, many of them in one commit.
#ifndef STRATA_CORE_ENGINE_MAP_WRITER_H_
#define STRATA_CORE_ENGINE_MAP_WRITER_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/engine/map/disk_space.h"
#include "core/storage/storage.h"

namespace strata {

// What a writer has done since it began.
struct WriterNumbers {
  std::uint64_t commits = 0;
  std::uint64_t parts = 0;  // works they were made of
  absl::Duration time;      // that they took, in all
  std::size_t queued_bytes = 0;
};

// Thread-safe.
class WriterThread {
 public:
  using Work = absl::FunctionRef<absl::Status(StorageWriter&)>;
  using Tell = absl::FunctionRef<void()>;

  // Both must outlive the thread; `storage` is written by nobody else. At most `queue_bytes` wait.
  WriterThread(StorageWriter& storage, const DiskSpace& disk, std::size_t queue_bytes);
  ~WriterThread();

  // Runs `work` inside a commit on the writer's thread and returns when it is committed with that
  // durability. kFull goes before kRelaxed; all kFull that wait share one commit, in which work
  // that fails is undone alone. `bytes`: of points in memory that the work stores; with a full
  // queue the call waits (CANCELLED, DEADLINE_EXCEEDED by `stop`), with a full disk it is
  // RESOURCE_EXHAUSTED. Once queued, the work is carried out. `tell` is called on the writer's
  // thread if and when it is committed: in the order of commits; again, where it throws for want of
  // memory. Work that throws is RESOURCE_EXHAUSTED or INTERNAL, and undone.
  absl::Status Run(Durability durability,
                   std::size_t bytes,
                   const Stop& stop,
                   Work work,
                   Tell tell = TellNobody);

  // As Run() with kFull, but in a commit of its own and behind every kFull that waits: for what
  // nobody waits for.
  absl::Status RunBehind(Work work, Tell tell);

  WriterNumbers numbers() const;
  // Why the last commit failed, if it did, and not longer ago; otherwise OK.
  absl::Status FailedWithin(absl::Duration time) const;
  // OK, or why what the store holds is not known here (MustBeOpenedAnew()): nothing is written any
  // more, and all is refused with it.
  absl::Status doubt() const;

  // Carries out what is queued, then refuses everything with CANCELLED. Safe to call again.
  void Close();

 private:
  static void TellNobody() {}
  struct Task {
    Work work;
    Tell tell;
    Durability durability;
    std::size_t bytes;
    absl::Status status;
    bool done = false;
  };
  using Queue = std::deque<Task*>;

  void Loop();
  // Queues the task and waits until it is carried out.
  absl::Status Await(Task& task, Queue& queue) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes what the next commit is made of into an empty `batch`; how that is committed.
  Durability TakeBatch(Queue& batch) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CommitBatch(Durability durability, const Queue& batch);
  static void TellOf(const Task& task);
  // One commit; whether there is none any more.
  absl::StatusOr<bool> RunNext();
  bool HasWorkOrClosed() const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  // Refuses what waits and what comes.
  void NoteDoubt(const absl::Status& doubt) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  StorageWriter& storage_;
  const DiskSpace& disk_;
  const std::size_t queue_bytes_;
  mutable absl::Mutex mutex_;
  absl::Status last_commit_ ABSL_GUARDED_BY(mutex_);
  absl::Time last_commit_at_ ABSL_GUARDED_BY(mutex_);
  WriterNumbers numbers_ ABSL_GUARDED_BY(mutex_);  // without queued_bytes
  Queue full_ ABSL_GUARDED_BY(mutex_);
  Queue behind_ ABSL_GUARDED_BY(mutex_);  // one a commit, once full_ is empty
  std::size_t queued_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status doubt_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_WRITER_H_
