#include "core/engine/writer.h"

#include <cstddef>
#include <utility>

#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/common/this_thread.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(50);

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
  absl::MutexLock lock(&mutex_);
  const auto has_room = [this, bytes]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return closed_ || queued_bytes_ == 0 || queued_bytes_ + bytes <= queue_bytes_;
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
  if (closed_) return absl::CancelledError("the map is being closed");
  queued_bytes_ += task.bytes;
  queue.push_back(&task);
  mutex_.Await(absl::Condition(&task.done));
  return task.status;
}

WriterNumbers WriterThread::numbers() const {
  absl::MutexLock lock(&mutex_);
  WriterNumbers numbers = numbers_;
  numbers.queued_bytes = queued_bytes_;
  return numbers;
}

bool WriterThread::HasWorkOrClosed() const { return closed_ || !full_.empty() || !behind_.empty(); }

WriterThread::Queue WriterThread::TakeBatch(Durability& durability) {
  durability = Durability::kFull;
  if (!full_.empty()) return std::exchange(full_, {});
  Queue batch;
  if (!behind_.empty()) {
    durability = behind_.front()->durability;
    batch.push_back(behind_.front());
    behind_.pop_front();
  }
  return batch;
}

void WriterThread::CommitBatch(Durability durability, const Queue& batch) {
  const absl::Status committed = storage_.Commit(durability, [&]() -> absl::Status {
    for (Task* task : batch) {
      task->status = storage_.Part([&] { return task->work(storage_); });
    }
    return absl::OkStatus();
  });
  for (Task* task : batch) {
    if (!task->status.ok()) continue;
    task->status = committed;
    if (committed.ok()) task->tell();
  }
}

void WriterThread::Loop() {
  NameThisThread("writer");
  while (true) {
    Durability durability = Durability::kFull;
    Queue batch;
    {
      absl::MutexLock lock(&mutex_);
      mutex_.Await(absl::Condition(this, &WriterThread::HasWorkOrClosed));
      batch = TakeBatch(durability);
      if (batch.empty()) return;
    }
    const absl::Time begun = SteadyNow();
    CommitBatch(durability, batch);
    absl::MutexLock lock(&mutex_);
    ++numbers_.commits;
    numbers_.parts += batch.size();
    numbers_.time += SteadyNow() - begun;
    for (Task* task : batch) {
      queued_bytes_ -= task->bytes;
      task->done = true;
    }
  }
}

}  // namespace strata
