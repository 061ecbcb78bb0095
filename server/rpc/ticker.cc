#include "server/rpc/ticker.h"

#include <utility>

#include "absl/time/clock.h"

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
    for (Task& task : due) executor_.Submit(task.client, std::move(task.run));
  }
}

}  // namespace strata::server
