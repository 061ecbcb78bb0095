#include "core/engine/worker.h"

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/blocking.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/this_thread.h"
#include "core/engine/rebuild.h"

namespace strata {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(50);
// After an error of the store (a full disk, say): how long until the next try.
constexpr absl::Duration kRetryDelay = absl::Seconds(1);

}  // namespace

Worker::Worker(MapCore& core, std::uint64_t pending)
    : core_(core), integrator_(core), pending_(pending), thread_([this] { Loop(); }) {}

Worker::~Worker() { Close(); }

absl::Status Worker::CheckRoom() const {
  absl::MutexLock lock(&mutex_);
  const std::uint64_t most = core_.options().max_pending_scans;
  if (pending_ < most) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(pending_, " scans wait for integration, at most ", most, "; retry later"));
}

void Worker::ScanCommitted() {
  absl::MutexLock lock(&mutex_);
  ++pending_;
}

absl::Status Worker::Execute(const Stop& stop, Command command, absl::string_view what) {
  Task task{command, what, absl::OkStatus()};
  const BlockingScope blocking;  // for as long as the pass under way takes
  absl::MutexLock lock(&mutex_);
  if (closed_) return absl::CancelledError("the map is being closed");
  tasks_.push_back(&task);
  while (!mutex_.AwaitWithTimeout(absl::Condition(&task.done), kStopPoll)) {
    absl::Status waiting = stop.status();
    if (waiting.ok() || task.begun) continue;
    tasks_.erase(std::find(tasks_.begin(), tasks_.end(), &task));
    return Annotate(waiting, absl::StrCat("waited for ", running_, " of map ", core_.name()));
  }
  return task.status;
}

bool Worker::HasWork() const { return closed_ || !tasks_.empty() || pending_ > 0; }

// Commands go first, since somebody waits for them.
Worker::Step Worker::NextStep() {
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(this, &Worker::HasWork));
  if (closed_) return Step::kClosed;
  return tasks_.empty() ? Step::kBatch : Step::kCommand;
}

void Worker::Loop() {
  NameThisThread("worker");
  YieldThisThread(5);  // what is acknowledged waits for nobody
  RunRecovery();
  while (true) {
    switch (NextStep()) {
      case Step::kClosed:
        return;
      case Step::kCommand:
        RunCommand();
        break;
      case Step::kBatch:
        RunBatch();
        break;
    }
  }
}

void Worker::RunCommand() {
  Task* task = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    if (tasks_.empty()) return;  // its caller gave up
    task = tasks_.front();
    tasks_.pop_front();
    task->begun = true;
    running_ = std::string(task->what);
  }
  const absl::Status status = task->command(integrator_);
  absl::MutexLock lock(&mutex_);
  task->status = status;
  task->done = true;
}

void Worker::RunBatch() {
  std::uint64_t waited = 0;
  {
    absl::MutexLock lock(&mutex_);
    waited = pending_;
    running_ = "integration";
  }
  const absl::StatusOr<int> done = integrator_.IntegrateBatch();
  absl::MutexLock lock(&mutex_);
  if (done.ok()) {
    // Scans that were deleted while they waited are counted, but are not there any more.
    pending_ -= *done == 0 ? waited : std::min(pending_, static_cast<std::uint64_t>(*done));
    return;
  }
  LOG(ERROR)
      << LogLine("integration").Add("map", core_.name()).Add("stopped", done.status().message());
  mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay);
}

void Worker::RunRecovery() {
  while (true) {
    const absl::Status done = RecoverDerived(integrator_, closing_);
    if (done.ok() || closing_.requested()) return;
    LOG(ERROR) << LogLine("recovery").Add("map", core_.name()).Add("stopped", done.message());
    absl::MutexLock lock(&mutex_);
    if (mutex_.AwaitWithTimeout(absl::Condition(&closed_), kRetryDelay)) return;
  }
}

void Worker::Close() {
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    for (Task* task : tasks_) {
      task->status = absl::CancelledError("the map is being closed");
      task->done = true;
    }
    tasks_.clear();
  }
  closing_.Request();
  if (thread_.joinable()) thread_.join();
}

}  // namespace strata
