#include "core/engine/map/writer.h"

#include <cstddef>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/common/this_thread.h"
#include "core/engine/map/engine_options.h"
#include "core/storage/outcome.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(50);
constexpr absl::Duration kNoMemoryPause = absl::Milliseconds(10);

}  // namespace

WriterThread::WriterThread(StorageWriter& storage, const DiskSpace& disk, std::size_t queue_bytes)
    : storage_(storage), disk_(disk), queue_bytes_(queue_bytes), thread_([this] { Loop(); }) {}

WriterThread::~WriterThread() { Close(); }

void WriterThread::Close() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
  }
  if (thread_.joinable()) thread_.join();
}

absl::Status WriterThread::Run(
    Durability durability, std::size_t bytes, const Stop& stop, Work work, Tell tell) {
  if (bytes > 0) STRATA_RETURN_IF_ERROR(disk_.CheckForUpload());
  Task task{work, tell, durability, bytes, absl::OkStatus()};
  const BlockingScope blocking;
  absl::MutexLock lock(&mutex_);
  const auto has_room = [this, bytes]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return closed_ || !doubt_.ok() || queued_bytes_ == 0 || queued_bytes_ + bytes <= queue_bytes_;
  };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&has_room), kStopPoll)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  return Await(task, durability == Durability::kFull ? full_ : behind_);
}

absl::Status WriterThread::RunBehind(Work work, Tell tell) {
  Task task{work, tell, Durability::kFull, 0, absl::OkStatus()};
  absl::MutexLock lock(&mutex_);
  return Await(task, behind_);
}

absl::Status WriterThread::Await(Task& task, Queue& queue) {
  STRATA_RETURN_IF_ERROR(doubt_);
  if (closed_) return absl::CancelledError("the map is being closed");
  queue.push_back(&task);
  queued_bytes_ += task.bytes;
  mutex_.Await(absl::Condition(&task.done));
  return task.status;
}

WriterNumbers WriterThread::numbers() const {
  absl::MutexLock lock(&mutex_);
  WriterNumbers numbers = numbers_;
  numbers.queued_bytes = queued_bytes_;
  return numbers;
}

absl::Status WriterThread::FailedWithin(absl::Duration time) const {
  absl::MutexLock lock(&mutex_);
  return SteadyNow() - last_commit_at_ <= time ? last_commit_ : absl::OkStatus();
}

absl::Status WriterThread::doubt() const {
  absl::MutexLock lock(&mutex_);
  return doubt_;
}

void WriterThread::NoteDoubt(const absl::Status& doubt) {
  constexpr char kUnknown[] =
      "the store may hold what this server does not know; the map is opened anew";
  doubt_ = doubt;
  Guarded([&] {  // the words may want memory, and whoever waits for the batch waits for this
    doubt_ =
        WithRetryDelay(IsOutcomeUnknown(doubt) ? Annotate(doubt, kUnknown) : doubt, kRetryDelay);
    return absl::OkStatus();
  })
      .IgnoreError();
  for (Queue* queue : {&full_, &behind_}) {
    for (Task* task : *queue) {
      queued_bytes_ -= task->bytes;
      task->status = doubt_;
      task->done = true;
    }
    queue->clear();
  }
}

bool WriterThread::HasWorkOrClosed() const { return closed_ || !full_.empty() || !behind_.empty(); }

// Into `batch`, not as a result: even to move a queue may take memory, and what was taken from the
// queues must not be lost.
Durability WriterThread::TakeBatch(Queue& batch) {
  if (!full_.empty()) {
    batch.swap(full_);
    return Durability::kFull;
  }
  if (behind_.empty()) return Durability::kFull;
  batch.push_back(behind_.front());
  behind_.pop_front();
  return batch.front()->durability;
}

absl::Status WriterThread::CommitBatch(Durability durability, const Queue& batch) {
  absl::Status committed = Guarded([&] {
    return storage_.Commit(durability, [&]() -> absl::Status {
      for (Task* task : batch) {
        task->status = storage_.Part([&] { return Guarded([&] { return task->work(storage_); }); });
      }
      return absl::OkStatus();
    });
  });
  for (Task* task : batch) {
    if (!task->status.ok()) continue;
    task->status = committed;
    if (committed.ok()) TellOf(*task);
  }
  return committed;
}

// What is committed cannot be taken back: it is told as soon as there is memory for it.
void WriterThread::TellOf(const Task& task) {
  const auto tell = [&task] {
    task.tell();
    return absl::OkStatus();
  };
  while (!Guarded(tell).ok()) absl::SleepFor(kNoMemoryPause);
}

void WriterThread::Loop() {
  NameThisThread("writer");
  while (true) {
    const absl::StatusOr<bool> closed = Guarded([this] { return RunNext(); });
    if (closed.ok() && *closed) return;
    if (!closed.ok()) absl::SleepFor(kNoMemoryPause);  // nothing was taken from the queues
  }
}

absl::StatusOr<bool> WriterThread::RunNext() {
  Durability durability = Durability::kFull;
  Queue batch;
  {
    absl::MutexLock lock(&mutex_);
    mutex_.Await(absl::Condition(this, &WriterThread::HasWorkOrClosed));
    durability = TakeBatch(batch);
    if (batch.empty()) return true;
  }
  const absl::Time begun = SteadyNow();
  absl::Status committed = CommitBatch(durability, batch);
  // Work that saw the store's end may say so alone.
  absl::Status doubt = committed;
  for (const Task* task : batch) {
    if (MustBeOpenedAnew(task->status)) doubt = task->status;
  }
  absl::MutexLock lock(&mutex_);
  if (MustBeOpenedAnew(doubt) && doubt_.ok()) NoteDoubt(doubt);
  last_commit_ = std::move(committed);
  last_commit_at_ = SteadyNow();
  ++numbers_.commits;
  numbers_.parts += batch.size();
  numbers_.time += SteadyNow() - begun;
  for (Task* task : batch) {
    queued_bytes_ -= task->bytes;
    task->done = true;
  }
  return false;
}

}  // namespace strata
