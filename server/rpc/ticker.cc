#include "server/rpc/ticker.h"

#include <functional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"

#include "core/common/guarded.h"
#include "core/common/this_thread.h"

namespace strata::server {

Ticker::Ticker(absl::Duration interval, Executor& executor)
    : interval_(interval), executor_(executor), thread_([this] { Loop(); }) {}

Ticker::~Ticker() {
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
  }
  thread_.join();
}

void Ticker::AtNextTick(absl::string_view client, std::function<void()> task) {
  absl::MutexLock lock(&mutex_);
  waiting_.push_back({std::string(client), std::move(task)});
}

// Somebody waits for every task: one for which there is no memory now is tried again.
void Ticker::Submit(const Task& task) {
  const auto submit = [&] {
    executor_.Submit(task.client, task.run);
    return absl::OkStatus();
  };
  while (!Guarded(submit).ok()) absl::SleepFor(interval_);
}

void Ticker::Loop() {
  NameThisThread("ticker");
  const auto needed = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return closing_ || !waiting_.empty();
  };
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      mutex_.Await(absl::Condition(&needed));
      if (closing_) return;
    }
    absl::SleepFor(interval_);
    std::vector<Task> due;
    {
      absl::MutexLock lock(&mutex_);
      due.swap(waiting_);
    }
    for (const Task& task : due) Submit(task);
  }
}

}  // namespace strata::server
