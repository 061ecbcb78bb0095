#include "server/rpc/executor.h"

#include <new>
#include <system_error>
#include <utility>

#include "core/common/this_thread.h"

namespace strata::server {

Executor::Executor(int most_threads, const char* name)
    : most_threads_(static_cast<std::size_t>(most_threads)), name_(name) {
  absl::MutexLock lock(&mutex_);
  AddThread();
}

void Executor::AddThread() {
  threads_.emplace_back([this] {
    NameThisThread(name_);
    Work();
  });
}

Executor::~Executor() {
  std::vector<std::thread> threads;
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
    threads.swap(threads_);
  }
  for (std::thread& thread : threads) thread.join();
}

void Executor::Submit(std::function<void()> task) {
  absl::MutexLock lock(&mutex_);
  tasks_.push_back(std::move(task));
  if (tasks_.size() <= idle_ || threads_.size() == most_threads_) return;
  try {
    AddThread();
  } catch (const std::system_error&) {
    // The system has no more to give; those that are there take it in their turn.
  } catch (const std::bad_alloc&) {
  }
}

void Executor::Work() {
  while (true) {
    std::function<void()> task;
    {
      absl::MutexLock lock(&mutex_);
      ++idle_;
      mutex_.Await(absl::Condition(this, &Executor::Ready));
      --idle_;
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

}  // namespace strata::server
